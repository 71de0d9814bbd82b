// SPDX-License-Identifier: MIT
// FrameReader: bytes in as they come, whole frames out.
//
//   room() ◄── read() ── line        | segment table | segments |  | segment table | seg...
//   filled(n) ─► tryNext() ─► Frame
//
// Memory grows with what has arrived, never with what a peer says will come.
//
// Threads  one.
// Trust    the bytes may be anything: what cannot be is a ProtocolError, and a Frame's pointers are
//          checked where they are followed.
#pragma once

#include <capnp/serialize.h>
#include <kj/array.h>
#include <kj/common.h>
#include <optional>

#include "router/protocol_error.h"

namespace mpf::router {

class FrameReader {
 public:
  explicit FrameReader(std::uint64_t maxFrameBytes);
  // From the next frame on.
  void setMaxFrameBytes(std::uint64_t bytes) noexcept { maxFrameBytes_ = bytes; }

  // Where the next bytes go; never empty. Valid until the next call.
  [[nodiscard]] kj::ArrayPtr<kj::byte> room();
  void filled(std::size_t bytes) noexcept { end_ += bytes; }

  // The next frame that is complete, readable until the next call of room() or tryNext(); nullptr
  // when there is none.
  //   throws  ProtocolError: too long, too many segments
  [[nodiscard]] capnp::MessageReader* tryNext();

  // Whether what has come is a record of TLS (handshake, alert), which is never the beginning of a
  // frame.
  [[nodiscard]] bool beginsAsTls() const noexcept;

  // Bytes of the frame that has begun to come.
  [[nodiscard]] std::size_t pending() const noexcept { return end_ - begin_; }

  static constexpr std::uint32_t kMaxSegments = 512;  // as Cap'n Proto's own readers have it

 private:
  [[nodiscard]] std::optional<std::uint64_t> frameBytes() const;
  [[nodiscard]] const kj::byte* at(std::size_t offset) const noexcept {
    return buffer_.asBytes().begin() + offset;
  }
  void makeRoom(std::size_t bytes);

  std::uint64_t maxFrameBytes_;
  kj::Array<capnp::word> buffer_;
  std::size_t begin_ = 0;  // of what has not been handed out; a multiple of a word
  std::size_t end_ = 0;
  std::optional<capnp::FlatArrayMessageReader> frame_;
};

}  // namespace mpf::router
