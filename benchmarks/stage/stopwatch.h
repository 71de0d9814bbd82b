// SPDX-License-Identifier: MIT
// Stopwatch: time between two points of one thread, with a resolution below a nanosecond where the
// processor has such a counter.
//
// The counter is read behind fences, so that nothing which is measured slips out of the interval;
// what a pair of readings costs by itself is measured once and taken off every duration.
//
// Threads  one; pin it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <mpf/clock.h>

namespace mpf::bench {

class Stopwatch {
 public:
  Stopwatch() noexcept {
    calibrate();
    // Many in a row, because of the counter's steps; the quickest of some rows, because of
    // interruptions.
    constexpr int kReadings = 1000;
    double least = 1e9;
    for (int row = 0; row < 8; ++row) {
      const auto from = start();
      for (int i = 1; i < kReadings; ++i) {
        static_cast<void>(stop());
        static_cast<void>(start());
      }
      least = std::min(least, toNs(stop() - from) / kReadings);
    }
    // Half of it lies inside an interval.
    costNs_ = least / 2;
  }

  [[nodiscard]] static std::uint64_t start() noexcept {
#if defined(__x86_64__)
    __builtin_ia32_lfence();
    return __builtin_ia32_rdtsc();
#else
    return static_cast<std::uint64_t>(Clock::nowNs());
#endif
  }
  [[nodiscard]] static std::uint64_t stop() noexcept {
#if defined(__x86_64__)
    std::uint32_t cpu{};
    const auto ticks = __builtin_ia32_rdtscp(&cpu);
    __builtin_ia32_lfence();
    return ticks;
#else
    return static_cast<std::uint64_t>(Clock::nowNs());
#endif
  }

  // Between a start() and a stop(), less what reading costs [ns].
  [[nodiscard]] double elapsed(std::uint64_t from, std::uint64_t to) const noexcept {
    return std::max(0.0, toNs(to - from) - costNs_);
  }
  [[nodiscard]] std::uint64_t elapsedNs(std::uint64_t from, std::uint64_t to) const noexcept {
    return static_cast<std::uint64_t>(std::llround(elapsed(from, to)));
  }
  [[nodiscard]] std::uint64_t ticksOf(Nanoseconds duration) const noexcept {
    return static_cast<std::uint64_t>(static_cast<double>(duration.count()) / nsPerTick_);
  }
  [[nodiscard]] double costNs() const noexcept { return costNs_; }

 private:
  [[nodiscard]] double toNs(std::uint64_t ticks) const noexcept {
    return static_cast<double>(ticks) * nsPerTick_;
  }

  // Over 5 ms: 20 ns of the clock's own error are 4 in a million.
  void calibrate() noexcept {
    const auto fromNs = Clock::nowNs();
    const auto from = start();
    while (Clock::nowNs() < fromNs + 5'000'000) {
    }
    const auto to = stop();
    nsPerTick_ = static_cast<double>(Clock::nowNs() - fromNs) / static_cast<double>(to - from);
  }

  double nsPerTick_ = 1.0;
  double costNs_ = 0.0;
};

}  // namespace mpf::bench
