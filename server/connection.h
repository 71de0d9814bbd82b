// SPDX-License-Identifier: MIT
// Connection: the server's end of one client's connection. Connection objects are reused;
// `generation` distinguishes the clients that have used the same object.
//
// Threads  as ServerCore; any thread may call take() and GiveBack.
// Lifetime a handle of a request refers to its connection by address and may outlive its server:
//          connections are never freed, and the servers of a process share them. There are as many
//          connections as the process has had clients at one time.
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
  // Returns a free connection; creates one when there is no free one.
  static Pointer take();

  std::shared_ptr<SpinLock> lock = std::make_shared<SpinLock>();
  std::shared_ptr<MessageLink> channel;  // under lock; empty: free
  std::uint32_t index = 0;
  std::uint32_t generation = 0;  // under lock
  // Ids of received requests without a reply, by their low bits; the size is a power of two.
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
