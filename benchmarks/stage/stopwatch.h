// SPDX-License-Identifier: MIT
// Stopwatch: the time between two points of one thread, with a resolution below a nanosecond on
// processors with such a counter.
//
// Fences around the reading of the counter keep the measured instructions inside the interval. The
// cost of the readings is measured once and subtracted from every duration.
//
// Threads  one, which must be pinned to a CPU.
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
    // Many readings in a row, because the counter moves in steps; the fastest of several rows,
    // because of interruptions.
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
    // Half of the cost is inside an interval.
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

  // The time between a start() and a stop(), without the cost of reading [ns].
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

  // Calibrates over 5 ms: the clock's error of 20 ns is then 4 parts in a million.
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
