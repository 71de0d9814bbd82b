// SPDX-License-Identifier: MIT
// DirectIo: reads and writes a plain TCP connection at once, as far as the kernel has data or room,
// beside the stream of kj that owns it. The stream needs several tasks of the event loop for each
// read and write, which take longer than the system call.
//
// Threads  that of the stream.
#pragma once

#include <cstddef>
#include <kj/async-io.h>
#include <optional>

namespace mpf::router {

class DirectIo {
 public:
  using Pieces = kj::ArrayPtr<const kj::ArrayPtr<const kj::byte>>;

  // Without a connection: there is never anything to read, nor room.
  DirectIo() = default;
  // `plain` outlives this object, and is not a TLS stream. No connection if it has no descriptor.
  // Do not read (write) while a read (write) of the stream is pending: the order would change.
  explicit DirectIo(kj::AsyncIoStream& plain);

  [[nodiscard]] explicit operator bool() const noexcept { return fd_ >= 0; }
  // Returns how many bytes it has read, 0 at the end of the stream; nullopt: nothing is there now.
  // `room` must not be empty.
  //   throws  kj::Exception, as the stream
  [[nodiscard]] std::optional<std::size_t> tryRead(kj::ArrayPtr<kj::byte> room) const;
  // Returns how many bytes it has written.
  //   throws  kj::Exception, as the stream
  [[nodiscard]] std::size_t tryWrite(Pieces pieces) const;

 private:
  int fd_ = -1;  // of the stream
};

}  // namespace mpf::router
