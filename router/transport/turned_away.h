// SPDX-License-Identifier: MIT
// TurnedAway: callers that are told why they cannot stay, before their connection is closed.
//
// Threads  that of the event loop.
// Trust    a caller that does not read is closed after a moment; of too many, the later ones are
//          closed at once.
#pragma once

#include <kj/async-io.h>
#include <string>

#include "router/protocol_error.h"

namespace mpf::router {

class TurnedAway final : private kj::TaskSet::ErrorHandler {
 public:
  explicit TurnedAway(kj::Timer& timer) : timer_(timer), tasks_(*this) {}

  // Sends a farewell, and closes once the caller has closed.
  void add(kj::Own<kj::AsyncIoStream> caller, FarewellCode code, const std::string& why);

 private:
  static constexpr unsigned kMost = 64;
  void taskFailed(kj::Exception&&) override {}  // it has gone

  kj::Timer& timer_;
  unsigned callers_ = 0;
  kj::TaskSet tasks_;
};

}  // namespace mpf::router
