// SPDX-License-Identifier: MIT
// GpibBus: a GPIB bus with any kind of controller, for any number of threads.
//
//   GpibBus bus(openPrologix(...));
//   const auto answer = bus.writeRead({22}, "ID?", {.maxBytes = 100}, 500ms);
//   if (!answer.ok()) log(answer.reason);
//
//   callers ──► queue, first come first served ──► one operation ──► GpibController ──► instruments
//                      │ a lease: only its holder passes                    │
//                      └ deadline: timeout                                  ├──► peek taps
//                                                                           └──► SRQ handlers
//
// A writeRead() is one operation: no other operation comes between the write and the read. A
// sequence of operations is exclusive with a lease, which has a time limit and a name that messages
// to other callers state.
//
//              lease()                             release(), destroyed
//   shared ───────────────────► leased by NAME ───────────────────────────► shared
//                                              ───────────────────────────►
//                                                time limit has passed
//
// Threads  any number of callers at a time. SRQ handlers run on a thread of the bus, one at a time;
//          they may call the bus. Peek handlers must not.
// Crash    nothing here survives the process.
// Trust    gpib_types.h. The deadline of an operation includes the wait for its turn.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <mpf/clock.h>
#include <mpf/drivers/gpib/gpib_controller.h>
#include <mpf/drivers/gpib/gpib_types.h>

namespace mpf {

struct GpibBusOptions {
  // How often a controller that does not report service requests is asked for them, while there is
  // an SRQ handler.
  std::chrono::milliseconds pollServiceRequestEvery{50};
};

// A user of the bus. Operations with the id of the lease's holder pass; 0 means no user.
using GpibUser = std::uint64_t;

// The present holder of the lease.
struct GpibLeaseHolder {
  GpibUser user = 0;
  std::string name;
  std::int64_t sinceNs = 0;  // CLOCK_MONOTONIC [ns]
  Deadline until = Deadline::never();
};

class GpibBus {
 public:
  using Bytes = std::span<const std::uint8_t>;
  using Milliseconds = std::chrono::milliseconds;

  // Takes the controller; sends IFC and sets REN.
  //   throws  std::runtime_error with the reason when the controller does not answer
  explicit GpibBus(std::unique_ptr<GpibController> controller, GpibBusOptions options = {});
  GpibBus(const GpibBus&) = delete;
  GpibBus& operator=(const GpibBus&) = delete;
  // No operation may be in progress.
  ~GpibBus();

  // Operations. `deadline` holds for the wait and the operation together.
  // After a write that failed, the instrument may hold a part of the data: clear() removes it.
  //   user  the caller; used only while the bus is leased
  GpibResult write(const GpibAddress& to, Bytes data, Deadline deadline, GpibUser user = 0,
                   bool sendEnd = true);
  GpibReadResult read(const GpibAddress& from, const GpibReadLimits& limits, Deadline deadline,
                      GpibUser user = 0);
  GpibReadResult writeRead(const GpibAddress& at, Bytes data, const GpibReadLimits& limits,
                           Deadline deadline, GpibUser user = 0);
  GpibResult sendCommands(Bytes commands, Deadline deadline, GpibUser user = 0);
  GpibPollResult serialPoll(const GpibAddress& at, Deadline deadline, GpibUser user = 0);
  GpibResult clearAll(Deadline deadline, GpibUser user = 0);
  GpibResult clear(const GpibAddress& at, Deadline deadline, GpibUser user = 0);
  GpibResult trigger(std::span<const GpibAddress> at, Deadline deadline, GpibUser user = 0);
  GpibResult interfaceClear(Deadline deadline, GpibUser user = 0);
  GpibResult remoteEnable(bool on, Deadline deadline, GpibUser user = 0);
  GpibResult localLockout(Deadline deadline, GpibUser user = 0);
  GpibResult goToLocal(const GpibAddress& at, Deadline deadline, GpibUser user = 0);

  // Makes the bus exclusive to `user` until release() or for `limit` at most; a holder that asks
  // again extends its lease. Operations of others wait for the end of the lease until their
  // deadline, and then end with `leased` and the name of the holder.
  //   user      not 0
  //   name      of the holder, for messages to people
  //   limit     longest time of the lease
  //   deadline  for the wait for another holder
  GpibResult lease(GpibUser user, std::string name, Milliseconds limit, Deadline deadline);
  // Ends the lease of `user`, after its operation in progress. Does nothing when `user` does not
  // hold the bus. Does not wait.
  void release(GpibUser user) noexcept;
  [[nodiscard]] std::optional<GpibLeaseHolder> leaseHolder() const;

  // A subscription ends when its object is destroyed; the handler does not run afterwards. It
  // must be destroyed before the bus. Move-only.
  class Subscription {
   public:
    Subscription() noexcept = default;
    Subscription(Subscription&&) noexcept = default;
    Subscription& operator=(Subscription&&) noexcept = default;
    ~Subscription() = default;

   private:
    friend class GpibBus;
    explicit Subscription(std::shared_ptr<void> entry) noexcept : entry_(std::move(entry)) {}
    std::shared_ptr<void> entry_;
  };
  // Calls `handler` each time when the SRQ line has become active, and again every
  // pollServiceRequestEvery while it stays active. The handler usually does serialPoll(). It
  // must not throw.
  [[nodiscard]] Subscription onServiceRequest(std::function<void()> handler);
  // Shows every byte of the bus to `handler`, with its ATN, EOI and direction.
  [[nodiscard]] Subscription attachTap(GpibPeekHandler handler);

  [[nodiscard]] std::string description() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mpf
