// SPDX-License-Identifier: MIT
// BusTurns: the turns of callers on a GPIB bus: a queue, first come first served, and a lease.
//
//   take() ──► | waiting | waiting | ──► on the bus ──► give()
//              while the bus is leased, only its holder gets a turn; others keep their places
//
//              lease()                             release()
//   shared ───────────────────► leased by NAME ───────────────────────────► shared
//                                              ───────────────────────────►
//                                                time limit has passed
//
// Threads  any number of callers at a time.
#pragma once

#include <chrono>
#include <condition_variable>
#include <list>
#include <mutex>
#include <optional>
#include <string>

#include <mpf/clock.h>
#include <mpf/drivers/gpib/gpib_bus.h>
#include <mpf/drivers/gpib/gpib_types.h>

namespace mpf {

class BusTurns {
 public:
  // A user that no lease excludes: the bus itself, which looks at the SRQ line.
  static constexpr GpibUser kBusItself = ~GpibUser{0};

  // Waits until the bus is the caller's. After success, the caller must call give().
  //   returns  success; leased, with the name of the holder; timeout
  [[nodiscard]] GpibResult take(GpibUser user, Deadline deadline);
  void give() noexcept;

  // As in GpibBus.
  [[nodiscard]] GpibResult lease(GpibUser user, std::string name, std::chrono::milliseconds limit,
                                 Deadline deadline);
  void release(GpibUser user) noexcept;
  [[nodiscard]] std::optional<GpibLeaseHolder> holder() const;
  // How many callers wait.
  [[nodiscard]] std::size_t waiting() const;

 private:
  struct Waiter {
    GpibUser user = 0;
    bool hasTurn = false;
    std::condition_variable changed{};
  };

  [[nodiscard]] bool isLeased() const noexcept { return lease_ && !lease_->until.hasPassed(); }
  [[nodiscard]] bool mayPass(GpibUser user) const noexcept;
  [[nodiscard]] GpibResult refusal(GpibUser user) const;
  void handOver() noexcept;

  mutable std::mutex mutex_;  // all below
  std::list<Waiter*> waiters_;  // in the order of their calls
  bool isBusy_ = false;
  std::optional<GpibLeaseHolder> lease_;  // may have ended: isLeased()
};

}  // namespace mpf
