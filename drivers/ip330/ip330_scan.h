// SPDX-License-Identifier: MIT
// Ip330Scan: the mean of a channel over the time that who asks wants (manual, "ip330Scan").
//
// Each reader says how long: two with different times on one channel do not disturb each other. With 0 it is what came since the last such
// reading of that channel, and the last sample when nothing came: never a mean of nothing.
//
// Threads  any. A reading waits for the first sample of a gain; stop() ends that.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <vector>

#include <mpf/drivers/ip330/ip330.h>
#include <mpf/drivers/ip330/running_mean.h>

namespace mpf {

inline constexpr std::uint64_t kIp330LongestMean = 65536;  // samples

class Ip330Scan {
 public:
  // For channels `first` to `last` of the board, which must outlive this.
  //   throws  std::invalid_argument when it does not scan them, std::length_error as Ip330::subscribe()
  Ip330Scan(Ip330& board, int first, int last);
  Ip330Scan(const Ip330Scan&) = delete;
  Ip330Scan& operator=(const Ip330Scan&) = delete;

  // The mean over the last `average` [ms]: of as many samples as came in that time, or since the board began to scan with this gain and in
  // this mode. Who wants another gain of the channel at the same time may take it away: then there is no mean.
  //   gain     code 0 to 3; the board is set to it when it has another
  //   returns  0 to 0xffff; nullopt when there is no such channel or gain, the time is negative or takes more samples than kIp330LongestMean,
  //            the gain cannot be calibrated, or no samples come with it
  [[nodiscard]] std::optional<int> tryRead(int channel, int gain, std::chrono::milliseconds average);
  // Readings that wait end, and none waits any more.
  void stop();

 private:
  struct Channel {
    RunningMean mean;
    int gain = 0;
    std::uint64_t epoch = 0;
    std::uint64_t readAt = 0;  // samples when it was read without a time
  };

  void take(const Ip330Sample& sample);
  [[nodiscard]] std::optional<std::uint64_t> samplesOf(std::chrono::milliseconds average) const;
  [[nodiscard]] bool hasSample(int channel, int gain) const;
  [[nodiscard]] bool comes(int channel, int gain) const;
  [[nodiscard]] bool waitForSample(std::unique_lock<std::mutex>& lock, int channel, int gain);

  Ip330& board_;
  const int first_;
  const int last_;
  std::mutex mutex_;
  std::condition_variable came_;
  bool isStopped_ = false;
  std::vector<Channel> channels_;
  Ip330::Subscription subscription_;  // last
};

// What Ip330Scan, Ip330Sweep and Ip330Pid say of channels that the board does not scan.
//   throws  std::invalid_argument
void expectIp330Channels(const Ip330& board, int first, int last);

}  // namespace mpf
