// SPDX-License-Identifier: MIT
// Ip330Pid: fast feedback from a channel of the board to an output. Each step uses one scan or the
// mean of several scans.
//
// While no scans come, or the channel is not calibrated, the output keeps its value. A change of
// the gain of the channel also changes the loop.
//
// Threads  any number of callers at a time. The interrupt thread of the board reads and writes the
//          output.
// Crash    the output keeps its value.
// Source   ip330PID, fastPID (std R1-3).
#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "drivers/ip330/analog_output.h"
#include "drivers/ip330/ip330.h"
#include "drivers/ip330/pid_loop.h"

namespace mpf {

class Ip330Pid {
 public:
  // Feedback is off at first.
  //
  //   board, output    must outlive this object
  //   lowest, highest  first limits of the loop [codes]
  //   hook             called when the output fails and when it answers again, like that of
  //                    Ip330Faults
  //   throws           std::invalid_argument, std::length_error as Ip330Scan
  Ip330Pid(Ip330& board, int channel, AnalogOutput& output, double lowest, double highest,
           Ip330Faults::Hook hook = {});
  Ip330Pid(const Ip330Pid&) = delete;
  Ip330Pid& operator=(const Ip330Pid&) = delete;

  // Starts feedback with the next scan, from the value of the output at that time.
  void start();
  void stop();
  // Changes the parameters of the loop; `change` must not call this object.
  void set(const std::function<void(PidLoop&)>& change);
  // Sets the time of a step; it is rounded to whole scans, at least one. Returns false for a
  // negative time or NaN.
  [[nodiscard]] bool trySetSecondsPerScan(double seconds);

  struct Status {
    PidLoop::Terms terms;
    double secondsPerScan = 0;
    // scans come, the last one was of a calibrated channel, and the output answers
    bool isGood = false;
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
  bool isWanted_ = false;  // feedback is switched on
  bool isFailing_ = false;  // the output does not answer
  bool isValid_ = true;     // the last sample was valid
  double seconds_ = 0;
  double sum_ = 0;
  int scans_ = 0;
  Ip330::Subscription subscription_;  // last: ends before the members that it uses
};

}  // namespace mpf
