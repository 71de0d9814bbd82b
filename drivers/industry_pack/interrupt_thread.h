// SPDX-License-Identifier: MIT
// InterruptThread: serves the interrupts of one module on a thread of its own, and what goes wrong with them.
//
//   InterruptThread thread(module.interrupt(0), {.pollEvery = 100ms}, [&](InterruptThread::Cause) { return chip.serve(); });
//
//   line active ──► handler ──► enabled again          the handler says whether the chip had asked
//   nothing for pollEvery ──► handler (poll)           an interrupt that never came: what waits in the chip is served late, not never
//   stormLimit times nothing to do ──► masked for stormPause, counted; polled meanwhile
//   lateLimit polls find something ──► the line is dead
//
// A line that is stuck does not hide behind traffic: each interrupt for which the chip had something only makes up for two that were in vain.
// A driver that wants to tell of a storm, a dead line or one that is polled now passes a second function, told once each time that one begins.
//
// Threads  both functions run on this object's thread, one at a time, with all signals blocked; it must not destroy this object.
//          The thread has the real-time priority of its interrupt, where the process may have it; see RealTimePriority.
// Crash    the carrier masks the line when it is opened again.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>

#include <mpf/base/clock.h>
#include <mpf/drivers/industry_pack/interrupt.h>

namespace mpf {

struct InterruptThreadOptions {
  // The handler runs at least that often; 0: only for interrupts.
  std::chrono::microseconds pollEvery{0};
  int stormLimit = 1000;  // interrupts for which the chip had nothing, less two for each one for which it had
  std::chrono::milliseconds stormPause{1000};
  int lateLimit = 5;  // polls that found something, without an interrupt in between
};

enum class InterruptTrouble : std::uint8_t {
  storm,  // the line is stuck; one that begins again within ten pauses is the same
  polled,  // its carrier has lost the means to be told, and polls from now on
  never,  // the chip asks and nothing comes; over with the next interrupt. Not told of a line that is masked in a storm
};

class InterruptThread {
 public:
  enum class Cause : std::uint8_t { interrupt, poll };
  // Returns whether the chip had asked for something.
  using Handler = std::function<bool(Cause)>;
  using TroubleHandler = std::function<void(InterruptTrouble)>;

  // Enables the interrupt.
  //   throws  std::system_error
  InterruptThread(Interrupt& interrupt, InterruptThreadOptions options, Handler handler, TroubleHandler trouble = {});
  // Disables it; after return the handler does not run any more.
  ~InterruptThread();
  InterruptThread(const InterruptThread&) = delete;
  InterruptThread& operator=(const InterruptThread&) = delete;

  // Runs the handler soon, as a poll.
  void wake() noexcept;

  struct Counters {
    std::uint64_t interrupts = 0;
    std::uint64_t spurious = 0;  // for which the chip had nothing
    std::uint64_t late = 0;  // polls that found what an interrupt should have told
    std::uint64_t storms = 0;
  };
  [[nodiscard]] Counters counters() const noexcept;

 private:
  void run(const std::stop_token& stop);
  void serveInterrupt();
  void servePoll();
  void pause();
  void goOn();
  void wait() const;
  void tell(InterruptTrouble trouble) const;
  void followPolling();
  [[nodiscard]] bool isPaused() const noexcept { return !pausedUntil_.isNever(); }

  Interrupt& interrupt_;
  InterruptThreadOptions options_;
  Handler handler_;
  TroubleHandler trouble_;
  FileDescriptor wakeUp_;
  int inVain_ = 0;  // interrupts, less what made up for them; this and below: the thread's
  int lateInRow_ = 0;  // polls that found something
  bool isPolled_;
  Deadline pausedUntil_ = Deadline::never();
  Deadline stormEnds_ = Deadline::atNs(0);  // afterwards the next one is another
  Deadline pollAt_ = Deadline::never();
  std::atomic<std::uint64_t> interrupts_{0}, spurious_{0}, late_{0}, storms_{0};
  std::jthread thread_;  // last: ends before what it uses
};

}  // namespace mpf
