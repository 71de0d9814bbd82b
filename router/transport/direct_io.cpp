// SPDX-License-Identifier: MIT
#include "router/transport/direct_io.h"

#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <kj/debug.h>

namespace mpf::router {
namespace {

constexpr std::size_t kMaxPieces = 64;  // with one system call

// Of the first kMaxPieces. kj ignores SIGPIPE.
std::size_t writeFirst(int fd, DirectIo::Pieces pieces) {
  std::array<iovec, kMaxPieces> parts;
  const auto count = std::min(pieces.size(), parts.size());
  for (std::size_t at = 0; at < count; ++at)
    parts[at] = {const_cast<kj::byte*>(pieces[at].begin()), pieces[at].size()};
  ssize_t written = 0;
  KJ_NONBLOCKING_SYSCALL(written = ::writev(fd, parts.data(), static_cast<int>(count)));
  return written < 0 ? 0 : static_cast<std::size_t>(written);
}

}  // namespace

DirectIo::DirectIo(kj::AsyncIoStream& plain) {
  KJ_IF_MAYBE (fd, plain.getFd()) fd_ = *fd;
}

std::optional<std::size_t> DirectIo::tryRead(kj::ArrayPtr<kj::byte> room) const {
  if (fd_ < 0) return std::nullopt;
  ssize_t bytes = 0;
  KJ_NONBLOCKING_SYSCALL(bytes = ::read(fd_, room.begin(), room.size()));
  if (bytes < 0) return std::nullopt;
  return static_cast<std::size_t>(bytes);
}

std::size_t DirectIo::tryWrite(Pieces pieces) const {
  std::size_t written = 0;
  while (fd_ >= 0 && pieces.size() != 0) {
    const auto first = pieces.slice(0, std::min(pieces.size(), kMaxPieces));
    std::size_t bytes = 0;
    for (const auto piece : first) bytes += piece.size();
    const auto now = writeFirst(fd_, first);
    written += now;
    if (now != bytes) break;
    pieces = pieces.slice(first.size(), pieces.size());
  }
  return written;
}

}  // namespace mpf::router
