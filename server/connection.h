// SPDX-License-Identifier: MIT
// Connection: one client's end at a server, used again and again; `generation` tells its lives
// apart.
//
// Threads  as ServerCore says; take() and GiveBack any.
// Crash    a handle of a request names its connection by address and may outlive its server: so
//          they are never freed, and the servers of a process share them. There are as many as it
//          had clients at once.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "shm/messages/message_link.h"

namespace mpf {

struct Connection {
  struct GiveBack {
    void operator()(Connection* connection) const noexcept;
  };
  using Pointer = std::unique_ptr<Connection, GiveBack>;
  // One that is free.
  static Pointer take();

  std::shared_ptr<SpinLock> lock = std::make_shared<SpinLock>();
  std::shared_ptr<MessageLink> channel;  // under lock; empty: free
  std::uint32_t index = 0;
  std::uint32_t generation = 0;  // under lock
  // a power of two: ids of requests that owe their first reply
  std::vector<std::atomic<std::uint32_t>> unanswered;
  std::uint32_t unansweredMask = 0;

  [[nodiscard]] std::atomic<std::uint32_t>& owed(std::uint32_t requestId) noexcept {
    return unanswered[requestId & unansweredMask];
  }
  std::uint32_t timedId = 0;  // the request whose service time is measured, under lock
  std::int64_t timedFromNs = 0;
  Connection* nextFree = nullptr;
};

}  // namespace mpf
