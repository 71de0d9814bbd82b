// SPDX-License-Identifier: MIT
// RareLog: says when an event that may come thousands of times a second should be logged: the first
// time, and then at most once a minute, with the number of times in between.
//
//   if (const auto times = surplus.note()) log->warn("surplus input, {} times", *times);
//
// Threads  one at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include <mpf/clock.h>

namespace mpf {

class RareLog {
 public:
  // Counts one event. Returns how many there were since the last one that was logged, this one
  // included, when this one should be logged.
  std::optional<std::uint64_t> note() noexcept {
    ++times_;
    if (!next_.hasPassed()) return std::nullopt;
    next_ = Deadline::after(std::chrono::minutes(1));
    return std::exchange(times_, 0);
  }

 private:
  std::uint64_t times_ = 0;
  Deadline next_ = Deadline::atNs(0);
};

}  // namespace mpf
