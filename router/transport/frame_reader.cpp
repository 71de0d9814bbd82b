// SPDX-License-Identifier: MIT
#include "router/transport/frame_reader.h"

#include <algorithm>
#include <cstring>
#include <fmt/format.h>

#include "schema/wire_places.h"

namespace mpf::router {
namespace {

constexpr std::size_t kWord = sizeof(capnp::word);
constexpr std::size_t kInitialBytes = std::size_t{64} << 10;
constexpr std::size_t kMinFreeBytes = std::size_t{4} << 10;
// Room for the next part of a long frame.
constexpr std::size_t kMinFreeInFrameBytes = std::size_t{16} << 10;
// A buffer that a long frame has made larger than this is freed afterwards.
constexpr std::size_t kMaxIdleBytes = std::size_t{4} << 20;

// Several pointers may lead to the same words, so a small frame could take very long to read. Valid
// frames are read fewer than four times.
capnp::ReaderOptions readerOptions(std::size_t bytes) {
  return {.traversalLimitInWords = 4 * (bytes / kWord) + 1024, .nestingLimit = 16};
}

}  // namespace

FrameReader::FrameReader(std::uint64_t maxFrameBytes)
    : maxFrameBytes_(maxFrameBytes), buffer_(kj::heapArray<capnp::word>(kInitialBytes / kWord)) {}

kj::ArrayPtr<kj::byte> FrameReader::room() {
  frame_.reset();
  if (begin_ == end_) begin_ = end_ = 0;
  const auto needed = frameBytes();
  const auto capacity = buffer_.size() * kWord;
  if (needed && *needed > capacity - begin_) {
    if (capacity - end_ < kMinFreeInFrameBytes)
      makeRoom(static_cast<std::size_t>(
          std::min<std::uint64_t>(*needed, std::max(2 * pending(), kInitialBytes))));
  } else if (!needed &&
             (capacity - end_ < kMinFreeBytes || (pending() == 0 && capacity > kMaxIdleBytes))) {
    makeRoom(kInitialBytes);
  }
  return buffer_.asBytes().slice(end_, buffer_.size() * kWord);
}

// Moves the pending bytes to the beginning of a buffer that has at least `bytes` bytes and room for
// more than the pending ones.
void FrameReader::makeRoom(std::size_t bytes) {
  const auto words = (std::max(bytes, pending() + kMinFreeBytes) + kWord - 1) / kWord;
  const auto used = pending();
  if (words > buffer_.size() || buffer_.size() * kWord > kMaxIdleBytes) {
    auto larger = kj::heapArray<capnp::word>(words);
    std::memcpy(larger.asBytes().begin(), at(begin_), used);
    buffer_ = kj::mv(larger);
  } else {
    std::memmove(buffer_.asBytes().begin(), at(begin_), used);
  }
  begin_ = 0;
  end_ = used;
}

// Length of the frame that begins at begin_; nullopt until its segment table has arrived.
std::optional<std::uint64_t> FrameReader::frameBytes() const {
  if (pending() < sizeof(std::uint32_t)) return std::nullopt;
  const std::uint64_t segments =
      std::uint64_t{loadLittle<std::uint32_t>(buffer_.asBytes(), begin_)} + 1;
  if (segments > kMaxSegments) {
    throw ProtocolError(
        FarewellCode::PROTOCOL,
        fmt::format("received a frame of {} segments; the limit is {}", segments, kMaxSegments));
  }
  const std::size_t table = (segments / 2 + 1) * kWord;
  if (pending() < table) return std::nullopt;
  std::uint64_t bytes = table;
  for (std::size_t segment = 0; segment < segments; ++segment) {
    const auto place = begin_ + 4 * (segment + 1);
    bytes += std::uint64_t{loadLittle<std::uint32_t>(buffer_.asBytes(), place)} * kWord;
  }
  if (bytes > maxFrameBytes_) {
    throw ProtocolError(
        FarewellCode::LIMIT,
        fmt::format("received a frame of {} bytes; the limit is {}", bytes, maxFrameBytes_));
  }
  return bytes;
}

// As a segment table, these bytes would announce more than kMaxSegments segments.
bool FrameReader::beginsAsTls() const noexcept {
  constexpr kj::byte kAlert = 0x15;
  constexpr kj::byte kHandshake = 0x16;
  constexpr kj::byte kMajorVersion = 3;
  if (pending() < 2) return false;
  return (*at(begin_) == kAlert || *at(begin_) == kHandshake) && *at(begin_ + 1) == kMajorVersion;
}

capnp::MessageReader* FrameReader::tryNext() {
  frame_.reset();
  const auto bytes = frameBytes();
  if (!bytes || *bytes > pending()) return nullptr;
  const auto words = static_cast<std::size_t>(*bytes) / kWord;
  const auto first = begin_ / kWord;
  frame_.emplace(buffer_.slice(first, first + words).asConst(), readerOptions(words * kWord));
  begin_ += words * kWord;
  return &*frame_;
}

}  // namespace mpf::router
