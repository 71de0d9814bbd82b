// SPDX-License-Identifier: MIT
// GpibRequestQueue: the requests of all clients of a GPIB server that wait for the bus.
//
//   server's thread ── push ──► client 1: | request | request |
//                               client 2: | request |            ── tryTake ──► bus thread
//                               client 3: | request | request |
//                    ◄── takeExpired, removeGone
//
// Clients take turns, one request each; requests of one client stay in their order. While the bus
// is leased, only requests of the holder are taken; other clients keep their places.
//
// Threads  any; wait() is for one thread.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <mutex>
#include <optional>
#include <vector>

#include <mpf/clock.h>
#include <mpf/drivers/gpib/gpib_bus.h>
#include <mpf/message_of.h>

#include "server/programs/gpib_server/gpib_request.h"

namespace mpf {

struct GpibWork {
  Char8ArrayMessage message;  // to reply to
  GpibUser client = 0;
  GpibRequest request;
};

class GpibRequestQueue {
 public:
  void push(GpibWork&& work);
  // Returns the request whose turn it is; nullopt when none may be taken.
  //   holder  of a lease; 0: there is no lease
  [[nodiscard]] std::optional<GpibWork> tryTake(GpibUser holder);
  // Waits until a push(), a wake() that came after the last wait(), or the deadline.
  void wait(Deadline deadline);
  void wake();

  // When takeExpired() has something to do, or earlier.
  [[nodiscard]] Deadline nextExpiry() const;
  // Removes the requests whose deadline has passed.
  [[nodiscard]] std::vector<GpibWork> takeExpired();
  // Drops the requests of all clients for which `isGone` is true of their first request.
  void removeGone(const std::function<bool(const GpibWork&)>& isGone);

 private:
  struct Client {
    GpibUser id = 0;
    std::deque<GpibWork> requests;  // at least one
  };

  mutable std::mutex mutex_;  // all below
  std::condition_variable changed_;
  bool isChanged_ = false;
  std::list<Client> clients_;  // the next one first
  Deadline nextExpiry_ = Deadline::never();
};

}  // namespace mpf
