// SPDX-License-Identifier: MIT
// TimeSampler: chooses which messages get a time stamp. If the peer polls: the first of each 64.
// Otherwise all, or at a high recent rate one of 2 to 64, because reading the clock costs as much
// as a message. The distance between samples varies, so that bursts
// are sampled evenly, from their first messages, which wake the peer, to their last ones. After a
// rest, all messages are timed until the rate is known again. Of messages that are sent as one run,
// only the first may be timed.
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

  // Whether to time the next message, before which `sent` messages were sent. If it was refused
  // after note(), its next attempt is due, too.
  [[nodiscard]] bool isDue(std::uint64_t sent) const noexcept {
    return sent >= due_ || sent == timed_;
  }
  // For a peer that polls: whether none of the same kMaxInterval messages was timed before.
  [[nodiscard]] bool isFirst(std::uint64_t sent) const noexcept {
    return sent == timed_ || sent / kMaxInterval != timed_ / kMaxInterval;
  }
  // That message gets the time `nowNs`.
  void note(std::uint64_t sent, std::int64_t nowNs) noexcept {
    const auto messages = sent - periodSent_;
    if (const auto ns = nowNs - periodNs_; ns >= kPeriodNs || messages >= kPeriodMessages) {
      const auto elapsed = static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 1));
      interval_ = std::clamp<std::uint64_t>((messages * kNsPerSample + elapsed - 1) / elapsed, 1,
                                            kMaxInterval);
      periodNs_ = nowNs;
      periodSent_ = sent;
    }
    timed_ = sent;
    due_ = sent + (interval_ + 1) / 2 + random_() % (interval_ | 1u);
  }

 private:
  static constexpr std::uint64_t kNsPerSample = 16'384;  // of fast traffic, on average
  // The rate is measured over this time or this number of messages, whichever comes first.
  static constexpr std::int64_t kPeriodNs = 4'000'000;
  static constexpr std::uint64_t kPeriodMessages = 1024;

  std::minstd_rand random_;
  std::uint64_t due_ = 0;
  std::uint64_t timed_ = 0;  // messages sent before the last one that was timed
  std::uint64_t interval_ = 1;
  std::int64_t periodNs_ = 0;  // start of the period
  std::uint64_t periodSent_ = 0;  // messages sent before it
};

}  // namespace mpf
