// SPDX-License-Identifier: MIT
#include "tools/tap/reader_watch.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "base/system_call.h"

namespace mpf::tools {
namespace {

bool hasReader() noexcept {
  struct stat file{};
  return ::fstat(STDOUT_FILENO, &file) == 0 && (S_ISFIFO(file.st_mode) || S_ISSOCK(file.st_mode));
}

}  // namespace

ReaderWatch::ReaderWatch(std::function<void()> onGone)
    : onGone_(std::move(onGone)), end_(checkCall(::eventfd(0, EFD_CLOEXEC), "eventfd")) {
  if (hasReader()) thread_ = std::jthread([this] { watch(); });
}

ReaderWatch::~ReaderWatch() { ::eventfd_write(end_.get(), 1); }

void ReaderWatch::watch() const {
  // poll() reports POLLERR and POLLHUP although no event is asked for.
  std::array<pollfd, 2> polled{{{STDOUT_FILENO, 0, 0}, {end_.get(), POLLIN, 0}}};
  retryInterrupted([&] { return ::poll(polled.data(), polled.size(), -1); });
  if ((polled[0].revents & (POLLERR | POLLHUP)) != 0) onGone_();
}

}  // namespace mpf::tools
