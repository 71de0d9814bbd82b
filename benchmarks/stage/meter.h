// SPDX-License-Identifier: MIT
// Meter: what the host did while a row was measured: how idle the CPUs of both sides were, and how
// often a process called to write.
//
// Idle is what /proc/stat says, in steps of 10 ms: a second is good for one percent. Writes are
// `syscw` of /proc/PID/io: each write() and writev() of all its threads, to whatever descriptor.
//
// Threads  one.
#pragma once

#include <cstdint>
#include <optional>

#include "benchmarks/stage/stage.h"

namespace mpf::bench {

class Meter {
 public:
  static constexpr int kThisProcess = 0;
  static constexpr int kNobody = -1;

  //   writer  pid of the process whose writes are counted
  Meter(const Placement& placement, int writer) : placement_(placement), writer_(writer) {}

  void start();
  // Fills in what is known of the time since start(), and leaves the rest as it is.
  void stop(Figures& figures) const;

 private:
  struct Reading {
    std::int64_t atNs = 0;
    double idleServer = 0;  // CPU time that nobody used so far, of all CPUs of the side [s]
    double idleRequester = 0;
    std::optional<std::uint64_t> writes;
  };
  [[nodiscard]] Reading read() const;

  Placement placement_;
  int writer_;
  Reading from_;
};

// CPU time that a process has used so far, of all its threads [ns]. Throws std::system_error when
// it is gone.
[[nodiscard]] double cpuNsOf(int pid);
// Memory of a process that is resident, shared memory that it has touched included [bytes]; 0 when
// it is gone.
[[nodiscard]] double residentBytesOf(int pid);

}  // namespace mpf::bench
