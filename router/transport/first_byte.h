// SPDX-License-Identifier: MIT
// FirstByte: looks at the first byte of a connection, so that a caller with the wrong security can
// be told.
//
//   stream ─► readFirstByte() ─► first byte, and the stream with all its bytes
//
// Threads  that of the event loop.
#pragma once

#include <kj/async-io.h>

namespace mpf::router {

inline constexpr kj::byte kTlsHandshakeByte = 0x16;  // of a record of TLS
inline constexpr kj::byte kFrameByte = 0;  // of the greeting of a router: a frame of one segment

struct FirstByte {
  kj::Maybe<kj::byte> value;  // nullptr: the caller closed the connection
  kj::Own<kj::AsyncIoStream> stream;
};

[[nodiscard]] kj::Promise<FirstByte> readFirstByte(kj::Own<kj::AsyncIoStream> stream);

}  // namespace mpf::router
