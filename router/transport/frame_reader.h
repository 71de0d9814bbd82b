// SPDX-License-Identifier: MIT
// FrameReader: assembles frames from the bytes of a connection.
//
//   room() ◄── read() ── stream      | segment table | segments |  | segment table | seg...
//   filled(n) ─► tryNext() ─► Frame
//
// Memory grows with the bytes that have arrived, never with a length that a peer announces.
//
// Threads  one.
// Trust    the bytes may have any value. An invalid segment table is a ProtocolError; the pointers
//          of a frame are checked when they are followed.
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
  // Applies from the next frame on.
  void setMaxFrameBytes(std::uint64_t bytes) noexcept { maxFrameBytes_ = bytes; }

  // The memory for the next bytes; never empty. Valid until the next call of a function.
  [[nodiscard]] kj::ArrayPtr<kj::byte> room();
  void filled(std::size_t bytes) noexcept { end_ += bytes; }

  // Returns the next complete frame, valid until the next call of room() or tryNext(); nullptr when
  // no frame is complete.
  //   throws  ProtocolError: the frame is too long or has too many segments
  [[nodiscard]] capnp::MessageReader* tryNext();

  // Whether the pending bytes begin a TLS record (handshake, alert), which is never the beginning
  // of a frame.
  [[nodiscard]] bool beginsAsTls() const noexcept;

  // The number of bytes that have arrived and have not been handed out as a frame.
  [[nodiscard]] std::size_t pending() const noexcept { return end_ - begin_; }

  static constexpr std::uint32_t kMaxSegments = 512;  // the limit of Cap'n Proto's own readers

 private:
  [[nodiscard]] std::optional<std::uint64_t> frameBytes() const;
  [[nodiscard]] const kj::byte* at(std::size_t offset) const noexcept {
    return buffer_.asBytes().begin() + offset;
  }
  void makeRoom(std::size_t bytes);

  std::uint64_t maxFrameBytes_;
  kj::Array<capnp::word> buffer_;
  std::size_t begin_ = 0;  // of the pending bytes; a multiple of the word size
  std::size_t end_ = 0;
  std::optional<capnp::FlatArrayMessageReader> frame_;
};

}  // namespace mpf::router
