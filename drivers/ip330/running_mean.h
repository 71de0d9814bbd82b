// SPDX-License-Identifier: MIT
// RunningMean: the mean of the last n samples, for any number of readers with different n.
//
// A ring holds the sums of all samples since restart(); a mean is the difference of two sums. The
// sums are integers that wrap around, so rounding errors do not accumulate.
//
// Threads  one at a time: the owner holds a lock.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace mpf {

class RunningMean {
 public:
  // Forgets all samples.
  void restart() noexcept {
    count_ = 0;
    sum_ = 0;
    oldest_ = 0;
    sums_[0] = 0;
  }
  // Adds a sample; its magnitude is at most 2^40.
  void add(double sample) noexcept {
    sum_ += static_cast<std::uint64_t>(std::llround(sample * kScale));
    sums_[++count_ & mask()] = sum_;
  }
  // The number of samples since restart().
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  // Makes room for means of n samples; samples that were dropped earlier stay lost.
  //   throws  std::bad_alloc
  void reserve(std::uint64_t n) {
    if (n < sums_.size()) return;
    std::vector<std::uint64_t> larger(std::bit_ceil(n + 1));
    const auto kept = std::min<std::uint64_t>(count_, mask());
    for (auto i = count_ - kept; i <= count_; ++i)
      larger[i & (larger.size() - 1)] = sums_[i & mask()];
    sums_ = std::move(larger);
    oldest_ = count_ - kept;
  }
  // Returns the mean of the last n samples, or of all samples if fewer are stored. n and count()
  // must not be 0.
  [[nodiscard]] double mean(std::uint64_t n) const noexcept {
    n = std::min({n, count_ - oldest_, mask()});
    return static_cast<double>(static_cast<std::int64_t>(sum_ - sums_[(count_ - n) & mask()])) /
           kScale / static_cast<double>(n);
  }

 private:
  static constexpr double kScale = 65536;
  [[nodiscard]] std::uint64_t mask() const noexcept { return sums_.size() - 1; }

  // the sum of the first i samples is at index i modulo size
  std::vector<std::uint64_t> sums_ = std::vector<std::uint64_t>(64);
  std::uint64_t count_ = 0;
  std::uint64_t oldest_ = 0;  // sums before this one were dropped while the ring was smaller
  std::uint64_t sum_ = 0;
};

}  // namespace mpf
