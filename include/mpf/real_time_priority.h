// SPDX-License-Identifier: MIT
// RealTimePriority: lets the calling thread run before all ordinary threads (SCHED_FIFO), as long
// as it sleeps most of the time.
//
//   RealTimePriority priority(kInterruptPriority);
//   while (...) {
//     wait();
//     serve();
//     priority.check();
//   }
//
//   ordinary ──► real time ── more than half of the last 50 ms on a processor ──┐
//                    ▲                                                          ▼
//                    └──────────────────────────────────────────────── ordinary for 1 s
//
// A real-time thread that never sleeps would starve all other threads, even the one whose result
// it waits for, if both need the same processor. Therefore check() removes the priority of a thread
// that uses too much processor time, and restores it one second later.
//
// Threads  one: the thread that constructs the object.
// Crash    the kernel ends the priority with the thread. Threads and processes that the thread
//          starts do not inherit it.
#pragma once

#include <cstdint>

#include <mpf/detail/cpp20.h>

namespace mpf {

// The priority of threads that serve interrupts: above all ordinary threads, below the kernel's
// interrupt threads, which have priority 50.
inline constexpr int kInterruptPriority = 20;

class RealTimePriority {
 public:
  // Sets the priority of the calling thread, if this process has the permission (CAP_SYS_NICE or
  // RLIMIT_RTPRIO). Otherwise the thread stays ordinary; isHeld() reports which. The thread keeps
  // the priority when the object is destroyed.
  //   priority  SCHED_FIFO priority, 1 to 99; 0 leaves the thread unchanged
  explicit RealTimePriority(int priority) noexcept;
  RealTimePriority(const RealTimePriority&) = delete;
  RealTimePriority& operator=(const RealTimePriority&) = delete;

  // Measures the thread's processor time, and removes or restores the priority. Call it at least
  // once between two waits, in the thread that constructed the object. A call takes some tens of
  // nanoseconds.
  void check() noexcept;
  // Whether the thread has the priority now.
  [[nodiscard]] bool isHeld() const noexcept { return isHeld_; }

  // Whether this process has the permission for this priority (1 to 99). Starts a thread, which
  // tries it, and waits until that thread has ended; false also if no thread can be started.
  [[nodiscard]] static bool isAllowed(int priority);

 private:
  void take() noexcept;
  void giveUp() noexcept;

  int priority_;
  bool isHeld_ = false;
  std::int64_t windowBeginNs_ = 0;  // start of the current measurement
  std::int64_t usedBeforeNs_ = 0;  // processor time of this thread at that start
  std::int64_t takeAgainNs_ = 0;  // while the priority is not held: when check() restores it
};

}  // namespace mpf
