// SPDX-License-Identifier: MIT
// Clock: the host's monotonic time, the same in every process, unmoved by changes of the wall
// clock.
#pragma once

#include <time.h>

#include <chrono>
#include <compare>
#include <cstdint>

namespace mpf {

using Nanoseconds = std::chrono::nanoseconds;

struct Clock {
  // CLOCK_MONOTONIC in nanoseconds; about 20 ns a call.
  [[nodiscard]] static std::int64_t nowNs() noexcept {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
  }
};

// A point in time after which a wait gives up. `never()` waits for ever, `at once` is a deadline
// that has passed.
class Deadline {
 public:
  [[nodiscard]] static Deadline never() noexcept { return Deadline(kNever); }
  [[nodiscard]] static Deadline after(Nanoseconds wait) noexcept {
    const auto now = Clock::nowNs();
    return wait.count() >= kNever - now ? never() : Deadline(now + wait.count());
  }
  [[nodiscard]] static Deadline atNs(std::int64_t monotonicNs) noexcept {
    return Deadline(monotonicNs);
  }

  [[nodiscard]] bool isNever() const noexcept { return ns_ == kNever; }
  [[nodiscard]] bool hasPassed() const noexcept { return !isNever() && Clock::nowNs() >= ns_; }
  [[nodiscard]] std::int64_t ns() const noexcept { return ns_; }
  // What is left, never negative.
  [[nodiscard]] Nanoseconds left() const noexcept {
    if (isNever()) return Nanoseconds::max();
    const auto left = ns_ - Clock::nowNs();
    return Nanoseconds(left > 0 ? left : 0);
  }
  friend auto operator<=>(const Deadline&, const Deadline&) = default;

 private:
  static constexpr std::int64_t kNever = INT64_MAX;
  explicit Deadline(std::int64_t ns) noexcept : ns_(ns) {}
  std::int64_t ns_;
};

}  // namespace mpf
