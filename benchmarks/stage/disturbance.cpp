// SPDX-License-Identifier: MIT
#include "benchmarks/stage/disturbance.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <string>

#include <mpf/clock.h>

#include "benchmarks/stage/meter.h"

namespace mpf::bench {
namespace {

double nsOf(const timeval& time) {
  return static_cast<double>(time.tv_sec) * 1e9 + static_cast<double>(time.tv_usec) * 1e3;
}

// CPU time of the living descendants of a process. One that ends meanwhile counts nothing.
double descendantsNs(int pid) {
  const auto process = std::to_string(pid);
  std::ifstream children("/proc/" + process + "/task/" + process + "/children");
  double sum = 0;
  for (int child = 0; children >> child;) {
    try {
      sum += cpuNsOf(child);
    } catch (const std::exception&) {
      continue;
    }
    sum += descendantsNs(child);
  }
  return sum;
}

}  // namespace

DisturbanceMeter::DisturbanceMeter(const Placement& placement) : cpus_(placement.server) {
  for (const auto cpu : placement.requester) {
    if (std::find(cpus_.begin(), cpus_.end(), cpu) == cpus_.end()) cpus_.push_back(cpu);
  }
  from_ = now();
}

DisturbanceMeter::Reading DisturbanceMeter::now() const {
  Reading reading;
  reading.atNs = Clock::nowNs();
  reading.idleNs = idleSeconds(cpus_) * 1e9;
  reading.ownNs = descendantsNs(::getpid());
  for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used{};
    ::getrusage(who, &used);
    reading.ownNs += nsOf(used.ru_utime) + nsOf(used.ru_stime);
    if (who == RUSAGE_CHILDREN)
      reading.preemptions = static_cast<std::uint64_t>(std::max(0L, used.ru_nivcsw));
  }
  return reading;
}

Disturbance DisturbanceMeter::read() const {
  const auto to = now();
  Disturbance disturbance;
  disturbance.availableNs =
      static_cast<double>(to.atNs - from_.atNs) * static_cast<double>(cpus_.size());
  disturbance.takenNs =
      disturbance.availableNs - (to.idleNs - from_.idleNs) - (to.ownNs - from_.ownNs);
  disturbance.preemptions = to.preemptions - from_.preemptions;
  return disturbance;
}

}  // namespace mpf::bench
