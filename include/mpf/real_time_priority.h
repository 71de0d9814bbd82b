// SPDX-License-Identifier: MIT
// RealTimePriority: lets the calling thread run before all ordinary threads (SCHED_FIFO), while it
// sleeps most of the time.
//
//   RealTimePriority priority(kInterruptPriority);
//   while (...) {
//     wait();
//     serve();
//     priority.check();
//   }
//
//   ordinary ──► real time ── more than half of the last 50 ms on a processor ──► ordinary for 1 s ──► real time
//
// A real-time thread that never sleeps would starve the machine, above all when the thing that it
// waits for needs the same processor. check() therefore takes the priority away from a thread that
// uses too much time, and gives it back later.
//
// Threads  one: the thread that constructs the object.
// Crash    the kernel ends the priority with the thread. Threads and processes that the thread
//          starts do not inherit it.
#pragma once

#include <cstdint>

namespace mpf {

// For threads that serve interrupts: above ordinary threads, below the kernel's interrupt threads,
// which have 50.
inline constexpr int kInterruptPriority = 20;

class RealTimePriority {
 public:
  // Takes the priority if this process may have it (CAP_SYS_NICE or RLIMIT_RTPRIO); otherwise
  // nothing changes.
  //   priority  1 to 99; 0: leave the thread as it is
  explicit RealTimePriority(int priority) noexcept;
  RealTimePriority(const RealTimePriority&) = delete;
  RealTimePriority& operator=(const RealTimePriority&) = delete;

  // Call it at least once between two waits. Takes some ten nanoseconds.
  void check() noexcept;
  [[nodiscard]] bool isHeld() const noexcept { return isHeld_; }

  // Whether a thread of this process may have that priority now. Starts a thread and waits for its
  // end.
  [[nodiscard]] static bool isAllowed(int priority);

 private:
  void take() noexcept;
  void giveUp() noexcept;

  int priority_;
  bool isHeld_ = false;
  std::int64_t windowBeginNs_ = 0;  // of the time in which the use of the processor is measured
  std::int64_t usedBeforeNs_ = 0;  // processor time of this thread at the beginning of the window
  std::int64_t takeAgainNs_ = 0;  // when it is not held
};

}  // namespace mpf
