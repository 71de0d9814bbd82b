// SPDX-License-Identifier: MIT
// Disturbance: how much of the CPUs of a row others took while it was measured: programs that do
// not belong to this run, the kernel's own work, and a host that runs other virtual machines.
//
//   taken = time x CPUs - idle time of the CPUs - CPU time of this process and its descendants
//
// Idle time is from /proc/stat, in steps of 10 ms for each CPU. CPU time is that of the scheduler,
// in microseconds. The load that a row starts itself is its own and is not counted.
//
// Threads  the runner's only thread, while the row's own processes do not run.
#pragma once

#include <cstdint>

#include "benchmarks/stage/mode.h"
#include "benchmarks/stage/stage.h"

namespace mpf::bench {

struct Disturbance {
  double takenNs = 0;
  double availableNs = 0;         // the row's time x CPUs; 0: not measured
  std::uint64_t preemptions = 0;  // involuntary context switches of the row's processes

  // Of the time that was available, 0 to 1.
  [[nodiscard]] double share() const noexcept {
    return availableNs > 0 ? takenNs / availableNs : 0;
  }
  // See README.md, "Rows that were disturbed", for the limits.
  [[nodiscard]] bool isLarge(Mode mode) const noexcept {
    return share() > (mode == Mode::spin ? kPollingShare : kSleepingShare) &&
           takenNs > kResolutionNs;
  }
  void add(const Disturbance& other) noexcept {
    takenNs += other.takenNs;
    availableNs += other.availableNs;
    preemptions += other.preemptions;
  }

  static constexpr double kPollingShare = 0.05;
  static constexpr double kSleepingShare = 0.15;  // the idle time of short sleeps is not exact
  static constexpr double kResolutionNs = 25e6;
};

class DisturbanceMeter {
 public:
  explicit DisturbanceMeter(const Placement& placement);

  // The disturbance since construction.
  [[nodiscard]] Disturbance read() const;

 private:
  struct Reading {
    std::int64_t atNs = 0;
    double idleNs = 0;  // of all CPUs of the row
    double ownNs = 0;
    std::uint64_t preemptions = 0;
  };
  [[nodiscard]] Reading now() const;

  Cpus cpus_;
  Reading from_;
};

}  // namespace mpf::bench
