// SPDX-License-Identifier: MIT
// Ip330Sweep: several channels over time, as a digitiser: arrays of points, each the mean of the scans in its dwell time.
//
// Points are whole scans of all channels `first` to `last`. It ends when the arrays are full, or at a preset time.
//
// Threads  any.
// Source   fastSweep and ip330Sweep: there the number of points was undefined until it was set, the last channel was not averaged, and it went
//          on by one point after the last.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include <mpf/drivers/ip330/ip330.h>

namespace mpf {

class Ip330Sweep {
 public:
  // For arrays of at most `maxPoints`, and that many at first.
  //   throws  std::invalid_argument, std::length_error as Ip330Scan
  Ip330Sweep(Ip330& board, int first, int last, int maxPoints);
  Ip330Sweep(const Ip330Sweep&) = delete;
  Ip330Sweep& operator=(const Ip330Sweep&) = delete;

  // Goes on where it stopped; does nothing while it acquires, or when the arrays are full.
  void start();
  void stop();
  // All points are 0, and the next is the first.
  void erase();

  // False: outside 1 to maxPoints.
  [[nodiscard]] bool trySetPoints(double points);
  // Rounded to whole scans, at least one. False: negative, or no number.
  [[nodiscard]] bool trySetSecondsPerPoint(double seconds);
  // It ends after that time; 0: it does not. False: negative, or no number.
  [[nodiscard]] bool trySetPreset(double seconds);

  struct Status {
    bool isAcquiring = false;
    double elapsedSeconds = 0;
    double secondsPerPoint = 0;
    int acquired = 0;  // points
  };
  [[nodiscard]] Status status();
  // All points of a channel, those that are not there yet as 0; nullopt when it has no such channel.
  [[nodiscard]] std::optional<std::vector<std::int32_t>> tryRead(int channel);

 private:
  void take(const Ip330Sample& sample);
  void addPoint();
  void endWhenDue();
  [[nodiscard]] double secondsSinceStart() const;

  Ip330& board_;
  const int first_;
  const int last_;
  const int maxPoints_;
  std::mutex mutex_;
  int points_;
  double secondsPerPoint_ = 0;
  double presetSeconds_ = 0;
  bool isAcquiring_ = false;
  std::int64_t startNs_ = 0;
  double elapsedSeconds_ = 0;  // of what has ended
  int acquired_ = 0;
  int scans_ = 0;  // of the point that grows
  std::vector<double> sums_;  // of it, by channel - first_
  std::vector<std::vector<std::int32_t>> data_;
  Ip330::Subscription subscription_;  // last
};

}  // namespace mpf
