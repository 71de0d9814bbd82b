// SPDX-License-Identifier: MIT
// Ip330Pid: fast feedback: a channel of the board is read scan by scan, or as the mean of several, and an output is driven.
//
// While no scans come, or the channel is not calibrated, the output stays as it is. Who changes the gain of the channel changes the loop.
//
// Threads  any. The output is read and written by the board's interrupt thread.
// Source   ip330PID, fastPID (std R1-3).
#pragma once

#include <functional>
#include <mutex>
#include <string>

#include <mpf/drivers/ip330/analog_output.h>
#include <mpf/drivers/ip330/ip330.h>
#include <mpf/drivers/ip330/pid_loop.h>

namespace mpf {

class Ip330Pid {
 public:
  //   output   must outlive this, as the board
  //   limits   of the output, in codes; they are the loop's at first
  //   hook     when the output fails, and when it answers again: as Ip330Faults
  //   throws   std::invalid_argument, std::length_error as Ip330Scan
  Ip330Pid(Ip330& board, int channel, AnalogOutput& output, double lowest, double highest, Ip330Faults::Hook hook = {});
  Ip330Pid(const Ip330Pid&) = delete;
  Ip330Pid& operator=(const Ip330Pid&) = delete;

  // Feedback begins with the next scan, from what the output is then.
  void start();
  void stop();
  // The loop's parameters; `change` must not call this object.
  void set(const std::function<void(PidLoop&)>& change);
  // Rounded to whole scans, at least one. False: negative, or no number.
  [[nodiscard]] bool trySetSecondsPerScan(double seconds);

  struct Status {
    PidLoop::Terms terms;
    double secondsPerScan = 0;
    bool isGood = false;  // scans come, the last one was of a calibrated channel, and the output answers
  };
  [[nodiscard]] Status status();

 private:
  void take(const Ip330Sample& sample);
  bool step(double actual);
  [[nodiscard]] int scansPerStep() const;

  Ip330& board_;
  const int channel_;
  AnalogOutput& output_;
  Ip330Faults::Hook hook_;
  std::mutex mutex_;
  PidLoop loop_;
  bool isWanted_ = false;  // feedback
  bool isFailing_ = false;  // the output
  bool isValid_ = true;     // the last sample
  double seconds_ = 0;
  double sum_ = 0;
  int scans_ = 0;
  Ip330::Subscription subscription_;  // last
};

}  // namespace mpf
