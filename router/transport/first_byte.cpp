// SPDX-License-Identifier: MIT
#include "router/transport/first_byte.h"

#include <cstdint>

namespace mpf::router {
namespace {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"  // kj::Own destroys the dynamic type
// A stream whose first byte has already been read. The first read returns this byte again.
class WithFirstByte final : public kj::AsyncIoStream {
 public:
  WithFirstByte(kj::byte first, kj::Own<kj::AsyncIoStream> stream)
      : first_(first), stream_(kj::mv(stream)) {}

  kj::Promise<std::size_t> tryRead(void* buffer, std::size_t least, std::size_t most) override {
    if (!hasFirst_ || most == 0) return stream_->tryRead(buffer, least, most);
    hasFirst_ = false;
    auto* const bytes = static_cast<kj::byte*>(buffer);
    bytes[0] = first_;
    if (least <= 1) return std::size_t{1};
    return stream_->tryRead(bytes + 1, least - 1, most - 1).then([](std::size_t more) {
      return more + 1;
    });
  }
  kj::Promise<void> write(const void* buffer, std::size_t size) override {
    return stream_->write(buffer, size);
  }
  kj::Promise<void> write(kj::ArrayPtr<const kj::ArrayPtr<const kj::byte>> pieces) override {
    return stream_->write(pieces);
  }
  kj::Promise<void> whenWriteDisconnected() override { return stream_->whenWriteDisconnected(); }
  void shutdownWrite() override { stream_->shutdownWrite(); }
  void abortRead() override { stream_->abortRead(); }
  void getsockopt(int level, int option, void* value, kj::uint* length) override {
    stream_->getsockopt(level, option, value, length);
  }
  void setsockopt(int level, int option, const void* value, kj::uint length) override {
    stream_->setsockopt(level, option, value, length);
  }
  void getsockname(sockaddr* address, kj::uint* length) override {
    stream_->getsockname(address, length);
  }
  void getpeername(sockaddr* address, kj::uint* length) override {
    stream_->getpeername(address, length);
  }

 private:
  kj::byte first_;
  bool hasFirst_ = true;
  kj::Own<kj::AsyncIoStream> stream_;
};
#pragma GCC diagnostic pop

}  // namespace

kj::Promise<FirstByte> readFirstByte(kj::Own<kj::AsyncIoStream> stream) {
  auto first = kj::heap<kj::byte>();
  auto* const into = first.get();
  auto read = stream->tryRead(into, 1, 1);
  return read.then(
      [first = kj::mv(first), stream = kj::mv(stream)](std::size_t bytes) mutable -> FirstByte {
        if (bytes == 0) return {nullptr, kj::mv(stream)};
        return {*first, kj::heap<WithFirstByte>(*first, kj::mv(stream))};
      });
}

}  // namespace mpf::router
