// SPDX-License-Identifier: MIT
// Clock and Deadline: the host's monotonic time, and a point of it at which a wait ends.
//
//   const auto deadline = Deadline::after(std::chrono::milliseconds(100));
//   while (!hasReply() && !deadline.hasPassed()) wait(deadline.left());
//
// The monotonic time is the same in all processes of one host. Changes of the wall clock do not
// move it. It does not count the time while the host is suspended, and starts again near 0 at each
// boot: do not store such times, and do not send them to another host. Send left() instead.
//
// Threads  any number of callers at a time; a Deadline is a plain value: share it as you share
//          an int. All functions are noexcept and do not allocate.
// Source   clock_gettime(2); the manual has timeouts in whole seconds ("StandardFieldsMessage").
#pragma once

#include <time.h>

#include <chrono>
#include <compare>
#include <concepts>
#include <cstdint>

#include <mpf/detail/cpp20.h>

namespace mpf {

// The unit of all durations of the public API; other units of std::chrono convert implicitly.
using Nanoseconds = std::chrono::nanoseconds;

// The source of all times that processes exchange: deadlines of requests, times of progress.
struct Clock {
  // The current CLOCK_MONOTONIC [ns], never negative. It does not fail, and is usually no system
  // call: about 20 ns.
  [[nodiscard]] static std::int64_t nowNs() noexcept {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return nsOf(now);
  }
  // The current CLOCK_REALTIME [ns], since 1970, for time stamps that people see and that other
  // hosts receive. It may jump.
  [[nodiscard]] static std::int64_t wallNs() noexcept {
    timespec now{};
    ::clock_gettime(CLOCK_REALTIME, &now);
    return nsOf(now);
  }

 private:
  static std::int64_t nsOf(const timespec& time) noexcept {
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  }
};

// The time at which a wait ends without a result. A small value: copy it freely. With a deadline
// that has passed, a wait checks once and returns. Deadlines compare by time; never() is later than
// all others.
class Deadline {
 public:
  // A deadline that never passes.
  [[nodiscard]] static Deadline never() noexcept { return Deadline(kNever); }
  // A deadline `wait` from now; never() if that time cannot be represented. If `wait` is zero or
  // negative, the deadline has passed already. Reads the clock.
  [[nodiscard]] static Deadline after(Nanoseconds wait) noexcept {
    const auto now = Clock::nowNs();
    return wait.count() >= kNever - now ? never() : Deadline(now + wait.count());
  }
  // The same for other units: a number that does not fit into Nanoseconds is not converted.
  template <std::integral Rep, class Period>
  [[nodiscard]] static Deadline after(std::chrono::duration<Rep, Period> wait) noexcept {
    const std::chrono::duration<double, std::nano> rounded = wait;
    if (rounded >= Nanoseconds::max()) return never();
    return after(wait.count() <= 0 ? Nanoseconds(0) : Nanoseconds(wait));
  }
  // A deadline at this CLOCK_MONOTONIC [ns]; INT64_MAX means never(). Processes of one host may
  // exchange such times.
  [[nodiscard]] static Deadline atNs(std::int64_t monotonicNs) noexcept {
    return Deadline(monotonicNs);
  }

  // Whether it never passes: made by never(), by after() with a wait that cannot be represented, or
  // by atNs(INT64_MAX).
  [[nodiscard]] bool isNever() const noexcept { return ns_ == kNever; }
  // Whether the time has been reached; always false for never(), which does not read the clock.
  [[nodiscard]] bool hasPassed() const noexcept { return !isNever() && Clock::nowNs() >= ns_; }
  // CLOCK_MONOTONIC [ns] of the deadline; INT64_MAX for never().
  [[nodiscard]] std::int64_t ns() const noexcept { return ns_; }
  // The remaining time, never negative: zero if the deadline has passed, Nanoseconds::max() for
  // never(). Adding to Nanoseconds::max() overflows: test isNever() before.
  [[nodiscard]] Nanoseconds left() const noexcept {
    if (isNever()) return Nanoseconds::max();
    const auto now = Clock::nowNs();
    return Nanoseconds(ns_ > now ? ns_ - now : 0);
  }
  // The earlier deadline is the smaller one: std::min(a, b) passes first.
  friend auto operator<=>(const Deadline&, const Deadline&) = default;

 private:
  static constexpr std::int64_t kNever = INT64_MAX;
  explicit Deadline(std::int64_t ns) noexcept : ns_(ns) {}
  std::int64_t ns_;
};

}  // namespace mpf
