// SPDX-License-Identifier: MIT
// Ip330Sweep: records several channels over time, like a digitiser, into arrays of points. Each
// point is the mean of the scans in its dwell time.
//
// A point consists of whole scans of all channels `first` to `last`. A sweep ends when the arrays
// are full or at a preset time.
//
// Threads  any number of callers at a time.
// Source   fastSweep and ip330Sweep. There the number of points was undefined until it was set, the
//          last channel was not averaged, and one point too many was recorded.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "drivers/ip330/ip330.h"

namespace mpf {

// Points of a sweep: an array of all of them is half the limit of a message.
inline constexpr int kIp330MostPoints = 1 << 23;

class Ip330Sweep {
 public:
  // Creates arrays of `maxPoints` points; all of them are used until trySetPoints() says otherwise.
  // `board` must outlive this object.
  //   throws  std::invalid_argument, std::length_error as Ip330Scan
  Ip330Sweep(Ip330& board, int first, int last, int maxPoints);
  Ip330Sweep(const Ip330Sweep&) = delete;
  Ip330Sweep& operator=(const Ip330Sweep&) = delete;

  // Starts, or continues after stop(). Has no effect during a sweep or when the arrays are full.
  void start();
  void stop();
  // Sets all points to 0; the next point is the first.
  void erase();

  // Sets the number of points of a sweep. Returns false unless it is 1 to maxPoints.
  [[nodiscard]] bool trySetPoints(double points);
  // Sets the dwell time; it is rounded to whole scans, at least one. Returns false for a negative
  // time or NaN.
  [[nodiscard]] bool trySetSecondsPerPoint(double seconds);
  // Sets the time after which a sweep ends; 0: no limit. Returns false for a negative time or NaN.
  [[nodiscard]] bool trySetPreset(double seconds);

  struct Status {
    bool isAcquiring = false;
    double elapsedSeconds = 0;
    double secondsPerPoint = 0;
    int acquired = 0;  // complete points
  };
  [[nodiscard]] Status status();
  // Returns all points of a channel, 0 for points that are not complete yet; nullopt when the sweep
  // does not include the channel.
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
  double elapsedSeconds_ = 0;  // of the parts before the last start()
  int acquired_ = 0;
  int scans_ = 0;  // of the incomplete point
  std::vector<double> sums_;  // of the incomplete point; index: channel - first_
  std::vector<std::vector<std::int32_t>> data_;
  Ip330::Subscription subscription_;  // last: ends before the members that it uses
};

}  // namespace mpf
