// SPDX-License-Identifier: MIT
// RequestKeeper: refuses requests whose handles are destroyed without a reply.
//
// Handles of requests may outlive their server, so keepers are never freed: they cost a few bytes
// for each server that the process creates. In the child of a fork, those of the parent do nothing.
//
// Threads  any.
#pragma once

#include <mutex>

#include <mpf/message.h>

#include "shm/fork_guard.h"

namespace mpf {

class ReplySender;

// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): never destroyed
class RequestKeeper final : public RouteKeeper {
 public:
  static RequestKeeper& make(ReplySender& replies);
  // The server ends: nothing is sent from now on.
  void leave() noexcept;
  void abandoned(const Route& route) noexcept override;

 private:
  explicit RequestKeeper(ReplySender& replies) noexcept : replies_(&replies) {}

  ForkGuard forkGuard_;
  std::mutex mutex_;
  ReplySender* replies_;  // nullptr after leave()
  RequestKeeper* older_ = nullptr;  // links all keepers, so that leak checkers find them reachable
};

}  // namespace mpf
