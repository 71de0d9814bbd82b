// SPDX-License-Identifier: MIT
// RefusedPeers: rejected connections. Each peer is sent a farewell with the reason before its
// connection is closed.
//
// Threads  that of the event loop.
// Trust    the connection of a peer that does not read is closed after a short time. When kMost
//          connections wait for their farewell, further ones are closed at once.
#pragma once

#include <kj/async-io.h>
#include <string>

#include "router/protocol_error.h"

namespace mpf::router {

class RefusedPeers final : private kj::TaskSet::ErrorHandler {
 public:
  explicit RefusedPeers(kj::Timer& timer) : timer_(timer), tasks_(*this) {}

  // Sends a farewell, and closes the connection after the peer has closed it.
  void add(kj::Own<kj::AsyncIoStream> caller, FarewellCode code, const std::string& why);

 private:
  static constexpr unsigned kMost = 64;
  void taskFailed(kj::Exception&&) override {}  // the connection is already closed

  kj::Timer& timer_;
  unsigned callers_ = 0;
  kj::TaskSet tasks_;
};

}  // namespace mpf::router
