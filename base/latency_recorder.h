// SPDX-License-Identifier: MIT
// LatencyRecorder: counts durations in log-linear buckets, as HdrHistogram does, and returns
// percentiles.
//
//   0 to 255 ns   exact
//   above         128 buckets per power of two: an error below 0.8 %
//   maximum       exact
//
// It contains no pointers, so it can be placed in memory that processes share.
//
// Threads  one thread.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace mpf {

class LatencyRecorder {
 public:
  void add(std::uint64_t ns) noexcept { add(ns, 1); }
  // Adds a duration `times` times.
  void add(std::uint64_t ns, std::uint64_t times) noexcept {
    if (times == 0) return;
    buckets_[indexOf(ns)] += times;
    count_ += times;
    sum_ += ns * times;
    max_ = std::max(max_, ns);
  }
  void add(const LatencyRecorder& other) noexcept {
    for (std::size_t index = 0; index < buckets_.size(); ++index)
      buckets_[index] += other.buckets_[index];
    count_ += other.count_;
    sum_ += other.sum_;
    max_ = std::max(max_, other.max_);
  }

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::uint64_t maxNs() const noexcept { return max_; }
  [[nodiscard]] double meanNs() const noexcept {
    return count_ == 0 ? 0.0 : static_cast<double>(sum_) / static_cast<double>(count_);
  }

  // The smallest duration that at least `percent` percent of the samples do not exceed. Returns 0
  // if there are no samples.
  [[nodiscard]] std::uint64_t percentileNs(double percent) const noexcept {
    // In thousandths of a percent, because a double cannot represent 99.9 exactly: a rank that is
    // too high by one sample could return the outlier itself.
    const auto thousandths = static_cast<std::uint64_t>(std::llround(percent * 1000));
    const auto rank = std::max<std::uint64_t>(1, (count_ * thousandths + 99'999) / 100'000);
    std::uint64_t seen = 0;
    for (std::size_t index = 0; index < buckets_.size(); ++index) {
      seen += buckets_[index];
      if (seen >= rank && seen != 0) return std::min(lastOf(index), max_);
    }
    return max_;
  }

 private:
  static constexpr std::uint32_t kBits = 7;  // 128 buckets per power of two
  static constexpr std::uint64_t kExact = std::uint64_t{2} << kBits;
  static constexpr std::uint32_t kPowers = 32;  // powers of two above `kExact`: up to 18 minutes

  static std::size_t indexOf(std::uint64_t ns) noexcept {
    if (ns < kExact) return ns;
    const auto shift = static_cast<std::uint32_t>(std::bit_width(ns)) - (kBits + 1);
    const auto index = (std::size_t{shift} << kBits) + (ns >> shift);
    return std::min(index, kBucketCount - 1);
  }
  // The largest duration in a bucket.
  static std::uint64_t lastOf(std::size_t index) noexcept {
    if (index < kExact) return index;
    const auto shift = (index >> kBits) - 1;
    const auto base = (index & ((1u << kBits) - 1)) + (1u << kBits);
    return ((base + 1) << shift) - 1;
  }

  static constexpr std::size_t kBucketCount = kExact + (std::size_t{kPowers} << kBits);
  std::array<std::uint64_t, kBucketCount> buckets_{};
  std::uint64_t count_ = 0;
  std::uint64_t sum_ = 0;
  std::uint64_t max_ = 0;
};

}  // namespace mpf
