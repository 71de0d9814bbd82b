// SPDX-License-Identifier: MIT
// Meter: measures the host while a row is taken: how idle the CPUs of both sides are, and how many
// write system calls a process makes.
//
// Idle time is from /proc/stat, in steps of 10 ms: one second gives a resolution of one percent.
// Writes are `syscw` of /proc/PID/io: each write() and writev() of all threads, to any descriptor.
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
  // Fills in the figures of the time since start(). Figures that are not known are not changed.
  void stop(Figures& figures) const;

 private:
  struct Reading {
    std::int64_t atNs = 0;
    double idleServer = 0;  // idle time so far, of all CPUs of the side [s]
    double idleRequester = 0;
    std::optional<std::uint64_t> writes;
  };
  [[nodiscard]] Reading read() const;

  Placement placement_;
  int writer_;
  Reading from_;
};

// Time that these CPUs have been idle so far, also while they waited for devices [s].
[[nodiscard]] double idleSeconds(const Cpus& cpus);
// CPU time that all threads of a process have used so far [ns]. Throws std::system_error when the
// process does not exist.
[[nodiscard]] double cpuNsOf(int pid);
// Resident memory of a process, including shared memory that it has touched [bytes]; 0 when the
// process does not exist.
[[nodiscard]] double residentBytesOf(int pid);

}  // namespace mpf::bench
