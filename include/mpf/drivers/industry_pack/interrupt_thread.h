// SPDX-License-Identifier: MIT
// InterruptThread: serves the interrupts of one module on a thread of its own; detects stuck lines
// and lost interrupts.
//
//   InterruptThread thread(module.interrupt(0), {.pollEvery = 100ms},
//                          [&](InterruptThread::Cause) { return chip.serve(); });
//
//   line active ──► handler ──► line enabled again     the handler returns whether the chip had a
//                                                      request
//   pollEvery passes ──► handler (poll)                serves a request whose interrupt was lost
//   stormLimit spurious interrupts ──► the line is masked and polled for stormPause
//   lateLimit polls find a request ──► the line is dead
//
//   calm ──stormLimit──► storm: masked ──stormPause──► storm: enabled ──2 x stormPause──► calm
//                          ▲                             │
//                          └──────────stormLimit─────────┘
//
// Traffic does not hide a stuck line: an interrupt with a request compensates only two spurious
// ones. A driver can pass a second function, which is called once each time a fault begins: a
// storm, a dead line, or a carrier that polls from now on.
//
// Threads  both functions run on this object's thread, one call at a time, with all signals
//          blocked; they must not destroy this object. The other functions may be called by any
//          thread. The thread has the real-time priority of its interrupt where the process may
//          set it; see RealTimePriority.
// Crash    the carrier masks the line when it is opened again.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>

#include <mpf/clock.h>
#include <mpf/drivers/industry_pack/interrupt.h>

namespace mpf {

struct InterruptThreadOptions {
  // Longest time between two calls of the handler; 0: it is called for interrupts only.
  std::chrono::microseconds pollEvery{0};
  int stormLimit = 1000;  // spurious interrupts, less two for each one with a request
  std::chrono::milliseconds stormPause{1000};  // how long a stuck line stays masked
  int lateLimit = 5;  // polls in a row that found a request, without an interrupt in between
};

enum class InterruptFault : std::uint8_t {
  storm,  // the line is stuck; reported once until the storm ends
  polled,  // the carrier gets no interrupts any more and polls from now on
  // the chip has requests, but no interrupt comes; ends with the next interrupt. Not during a storm
  dead,
};

class InterruptThread {
 public:
  enum class Cause : std::uint8_t { interrupt, poll };
  // Returns whether the chip had a request.
  using Handler = std::function<bool(Cause)>;
  using FaultHandler = std::function<void(InterruptFault)>;

  // Starts the thread and enables the interrupt. `interrupt` must outlive this object.
  //   throws  std::system_error when the thread or its descriptor cannot be created
  InterruptThread(Interrupt& interrupt, InterruptThreadOptions options, Handler handler,
                  FaultHandler onFault = {});
  // Disables the interrupt; the handler does not run after return.
  ~InterruptThread();
  InterruptThread(const InterruptThread&) = delete;
  InterruptThread& operator=(const InterruptThread&) = delete;

  // Calls the handler soon, with Cause::poll.
  void wake() noexcept;

  struct Counters {
    std::uint64_t interrupts = 0;
    std::uint64_t spurious = 0;  // interrupts without a request of the chip
    std::uint64_t late = 0;  // polls that found a request whose interrupt had not come
    std::uint64_t storms = 0;  // pauses because of a storm: a line that stays stuck causes several
  };
  [[nodiscard]] Counters counters() const noexcept;
  // Whether a storm has begun that has not ended: the line is masked, or was enabled again less
  // than two pauses ago.
  [[nodiscard]] bool isStorming() const noexcept {
    return isStorming_.load(std::memory_order_relaxed);
  }

 private:
  void run(const std::stop_token& stop);
  void serveInterrupt();
  void servePoll();
  void pause();
  void resume();
  void endStorm();
  void wait() const;
  void report(InterruptFault fault) const;
  void followPolling();
  [[nodiscard]] bool isPaused() const noexcept { return !pausedUntil_.isNever(); }

  Interrupt& interrupt_;
  InterruptThreadOptions options_;
  Handler handler_;
  FaultHandler onFault_;
  FileDescriptor wakeUp_;
  // spurious interrupts less compensation; this and below: used by the thread only
  int spuriousExcess_ = 0;
  int lateInRow_ = 0;  // polls in a row that found a request, at most lateLimit
  bool isPolled_;
  Deadline pausedUntil_ = Deadline::never();
  Deadline stormEnds_ = Deadline::never();  // set while the line is enabled in a storm
  std::atomic<bool> isStorming_{false};
  Deadline pollAt_ = Deadline::never();
  std::atomic<std::uint64_t> interrupts_{0}, spurious_{0}, late_{0}, storms_{0};
  std::jthread thread_;  // last: ends before the members that it uses
};

}  // namespace mpf
