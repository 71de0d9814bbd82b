// SPDX-License-Identifier: MIT
// Ip330Scan: the mean of a channel over a time that each reader chooses (manual, "ip330Scan").
//
// Readers with different times on one channel do not disturb each other. With a time of 0 the mean
// covers all samples since the last such reading of the channel; without new samples it is the last
// sample.
//
// Threads  any number of callers at a time. A reading waits for the first sample of a gain; stop()
//          ends the wait.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <vector>

#include "drivers/ip330/ip330.h"
#include "drivers/ip330/running_mean.h"

namespace mpf {

inline constexpr std::uint64_t kIp330LongestMean = 65536;  // samples

class Ip330Scan {
 public:
  // Reads channels `first` to `last` of the board, which must outlive this object.
  //   throws  std::invalid_argument when the board does not scan these channels, std::length_error
  //           as Ip330::subscribe()
  Ip330Scan(Ip330& board, int first, int last);
  Ip330Scan(const Ip330Scan&) = delete;
  Ip330Scan& operator=(const Ip330Scan&) = delete;

  // Returns the mean over the last `average` [ms], or over the shorter time for which the board has
  // scanned with this gain and in this mode. Another reader may set another gain of the channel at
  // the same time; the reading may then fail.
  //
  //   gain     code 0 to 3; the channel is set to it if needed
  //   returns  0 to 0xffff; nullopt when the channel or gain does not exist, the time is negative
  //            or needs more than kIp330LongestMean samples, the gain cannot be calibrated, or no
  //            samples come
  [[nodiscard]] std::optional<int> tryRead(int channel, int gain,
                                           std::chrono::milliseconds average);
  // Ends all waiting readings; later readings do not wait.
  void stop();

 private:
  struct Channel {
    RunningMean mean;
    int gain = 0;
    std::uint64_t epoch = 0;
    std::uint64_t readAt = 0;  // number of samples at the last reading with time 0
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
  Ip330::Subscription subscription_;  // last: ends before the members that it uses
};

// Checks channels for Ip330Scan, Ip330Sweep and Ip330Pid.
//   throws  std::invalid_argument when the board does not scan them
void expectIp330Channels(const Ip330& board, int first, int last);

}  // namespace mpf
