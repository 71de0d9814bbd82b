// SPDX-License-Identifier: MIT
// TimeSampler: chooses which messages to a peer that does not poll get a time stamp: all of them,
// or of fast traffic one in 2 to 64, because reading the clock costs as much as a message. The rate
// of the last few milliseconds decides. The distance between samples varies, so that a burst is
// sampled evenly, from its first message, which wakes the peer, to its last.
//
// Threads  one at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>

namespace mpf {

class TimeSampler {
 public:
  static constexpr std::uint64_t kMaxInterval = 64;  // messages from sample to sample, on average

  // Whether to time the next message, before which `sent` messages were sent.
  [[nodiscard]] bool isDue(std::uint64_t sent) const noexcept { return sent >= due_; }
  // That message gets the time `nowNs`.
  void note(std::uint64_t sent, std::int64_t nowNs) noexcept {
    if (const auto ns = nowNs - windowNs_; ns >= kWindowNs) {
      const auto most = static_cast<std::uint64_t>(ns / kNsPerSample);
      interval_ = std::clamp<std::uint64_t>((sent - windowSent_) / most, 1, kMaxInterval);
      windowNs_ = nowNs;
      windowSent_ = sent;
    }
    due_ = sent + (interval_ + 1) / 2 + random_() % interval_;
  }

 private:
  static constexpr std::int64_t kNsPerSample = 16'384;  // of fast traffic, on average
  static constexpr std::int64_t kWindowNs = 4'000'000;

  std::minstd_rand random_;
  std::uint64_t due_ = 0;
  std::uint64_t interval_ = 1;
  std::int64_t windowNs_ = 0;  // the window in which messages are counted: when it began
  std::uint64_t windowSent_ = 0;  // messages sent before it
};

}  // namespace mpf
