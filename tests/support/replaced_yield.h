// SPDX-License-Identifier: MIT
// ReplacedYield: while it exists, sched_yield() of its thread calls a function instead. Include it
// in one file of a program.
#pragma once

#include <sys/syscall.h>
#include <unistd.h>

#include <functional>
#include <utility>

#include <mpf/clock.h>

namespace mpf::test {

class ReplacedYield {
 public:
  explicit ReplacedYield(std::function<void()> instead) : instead_(std::move(instead)) {
    current = &instead_;
  }
  ~ReplacedYield() { current = nullptr; }
  ReplacedYield(const ReplacedYield&) = delete;
  ReplacedYield& operator=(const ReplacedYield&) = delete;

  static inline thread_local const std::function<void()>* current = nullptr;

 private:
  std::function<void()> instead_;
};

// Others use the processor for this time.
inline void othersRun(Nanoseconds time) {
  const auto end = Deadline::after(time);
  while (!end.hasPassed()) {
  }
}

}  // namespace mpf::test

extern "C" int sched_yield() noexcept {
  if (mpf::test::ReplacedYield::current == nullptr)
    return static_cast<int>(::syscall(SYS_sched_yield));
  (*mpf::test::ReplacedYield::current)();
  return 0;
}
