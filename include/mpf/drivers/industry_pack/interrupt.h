// SPDX-License-Identifier: MIT
// Interrupt: one interrupt request line of a module, with a file descriptor to wait on.
//
//   interrupt.enable();
//   poll(interrupt.descriptor());      // readable once the line has been active
//   if (interrupt.take() > 0) {
//     ...                              // make the chip release the line
//     interrupt.enable();              // the carrier has masked the line
//   }
//
// The line is level-sensitive: if it is still active at enable(), the next interrupt comes at once.
//
// Threads  any number of callers at a time.
// Crash    the carrier masks the line when it is opened again.
#pragma once

#include <atomic>
#include <cstdint>

#include <mpf/file_descriptor.h>
#include <mpf/real_time_priority.h>

namespace mpf {

class Interrupt {
 public:
  //   throws  std::system_error when no descriptor can be created
  Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  virtual ~Interrupt() = default;

  // For poll() and the like: readable when an interrupt has come. Read it with take() only. Valid
  // as long as this object.
  [[nodiscard]] int descriptor() const noexcept { return event_.get(); }
  // Returns the number of interrupts since the last call, without waiting: 0 or 1, or more if
  // enable() was called in between.
  std::uint64_t take() noexcept;

  // Unmasks the line for one interrupt.
  virtual void enable() = 0;
  // Masks the line: no interrupt comes after return. One that has come before can still be taken.
  virtual void disable() noexcept = 0;
  // Returns whether the carrier polls the line because it cannot get an interrupt. This may become
  // true at any time.
  [[nodiscard]] virtual bool isPolled() const noexcept { return false; }

  // The real-time priority of the threads that serve this line, 1 to 99; 0: none. Set it before the
  // first enable().
  void setPriority(int priority) noexcept { priority_.store(priority, std::memory_order_relaxed); }
  [[nodiscard]] int priority() const noexcept { return priority_.load(std::memory_order_relaxed); }

 protected:
  // Called by the carrier when it has seen the line active and has masked it. Async-signal-safe.
  void announce() noexcept;

 private:
  FileDescriptor event_;
  std::atomic<int> priority_{kInterruptPriority};
};

}  // namespace mpf
