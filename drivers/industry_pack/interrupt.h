// SPDX-License-Identifier: MIT
// Interrupt: one interrupt request line of a module, as a file descriptor to wait on.
//
//   interrupt.enable();
//   poll(interrupt.descriptor());      // readable: the line was active
//   if (interrupt.take() > 0) {
//     ...                              // make the chip release the line
//     interrupt.enable();              // it was masked at the carrier when it came
//   }
//
// The line is level-sensitive: when it is still active at enable(), it comes again at once.
//
// Threads  any. The descriptor lives as long as this object.
#pragma once

#include <atomic>
#include <cstdint>

#include <mpf/base/file_descriptor.h>
#include <mpf/base/real_time_priority.h>

namespace mpf {

class Interrupt {
 public:
  // Throws std::system_error when there is no descriptor left.
  Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  virtual ~Interrupt() = default;

  // Poll it for reading. Somebody else reads it: take().
  [[nodiscard]] int descriptor() const noexcept { return event_.get(); }
  // Takes what has come, without waiting. Returns how many interrupts: 0 or 1, more when enable() was called in between.
  std::uint64_t take() noexcept;

  virtual void enable() = 0;
  // After return none comes any more; one that has come already can still be taken.
  virtual void disable() noexcept = 0;
  // The carrier looks for it from time to time, because nothing tells it; that may begin while it is used. Any thread.
  [[nodiscard]] virtual bool isPolled() const noexcept { return false; }

  // The real-time priority of the threads that serve this line, 1 to 99; 0: none. Set it before the first enable().
  void setPriority(int priority) noexcept { priority_.store(priority, std::memory_order_relaxed); }
  [[nodiscard]] int priority() const noexcept { return priority_.load(std::memory_order_relaxed); }

 protected:
  // For the carrier, when it has seen the line active and masked it. Async-signal-safe.
  void announce() noexcept;

 private:
  FileDescriptor event_;
  std::atomic<int> priority_{kInterruptPriority};
};

}  // namespace mpf
