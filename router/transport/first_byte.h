// SPDX-License-Identifier: MIT
// FirstByte: examines the first byte of a connection, so that a peer with the wrong security gets
// an error message.
//
//   stream ─► readFirstByte() ─► the first byte, and the stream with all of its bytes
//
// Threads  that of the event loop.
#pragma once

#include <kj/async-io.h>

namespace mpf::router {

// The first byte of a router's greeting, which is a frame of one segment.
inline constexpr kj::byte kFrameByte = 0;

struct FirstByte {
  kj::Maybe<kj::byte> value;  // nullptr: the peer closed the connection
  kj::Own<kj::AsyncIoStream> stream;
};

[[nodiscard]] kj::Promise<FirstByte> readFirstByte(kj::Own<kj::AsyncIoStream> stream);

}  // namespace mpf::router
