// SPDX-License-Identifier: MIT
#include "benchmarks/stage/meter.h"

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

#include <mpf/clock.h>

#include "base/system_call.h"

namespace mpf::bench {
namespace {

// The number after `key` at the beginning of a line.
std::optional<std::uint64_t> valueIn(const std::string& path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::uint64_t value = 0;
    if (line.starts_with(key) && std::istringstream(line.substr(key.size())) >> value) return value;
  }
  return std::nullopt;
}

std::string fileOf(int pid, const char* name) {
  return "/proc/" + (pid == Meter::kThisProcess ? "self" : std::to_string(pid)) + "/" + name;
}

}  // namespace

// Reads the lines "cpuN user nice system idle iowait ..." of /proc/stat.
double idleSeconds(const Cpus& cpus) {
  std::ifstream file("/proc/stat");
  double ticks = 0;
  for (std::string line; std::getline(file, line) && line.starts_with("cpu");) {
    std::istringstream words(line.substr(3));
    int cpu = -1;
    double user{}, nice{}, system{}, idle{}, waiting{};
    if (line[3] == ' ' || !(words >> cpu >> user >> nice >> system >> idle >> waiting)) continue;
    if (std::find(cpus.begin(), cpus.end(), cpu) != cpus.end()) ticks += idle + waiting;
  }
  return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

Meter::Reading Meter::read() const {
  Reading reading;
  reading.idleServer = idleSeconds(placement_.server);
  reading.idleRequester = idleSeconds(placement_.requester);
  if (writer_ != kNobody) reading.writes = valueIn(fileOf(writer_, "io"), "syscw:");
  reading.atNs = Clock::nowNs();
  return reading;
}

void Meter::start() { from_ = read(); }

void Meter::stop(Figures& figures) const {
  const auto to = read();
  const auto seconds = static_cast<double>(to.atNs - from_.atNs) / 1e9;
  if (seconds <= 0) return;
  const auto share = [&](double from, double until, const Cpus& cpus) {
    return std::clamp((until - from) / seconds / static_cast<double>(cpus.size()), 0.0, 1.0);
  };
  figures.idleServer = share(from_.idleServer, to.idleServer, placement_.server);
  figures.idleRequester = share(from_.idleRequester, to.idleRequester, placement_.requester);
  if (from_.writes && to.writes)
    figures.writesPerSecond = static_cast<double>(*to.writes - *from_.writes) / seconds;
}

double cpuNsOf(int pid) {
  clockid_t clock{};
  if (const int failed = ::clock_getcpuclockid(pid, &clock); failed != 0)
    throwSystemError(failed, "clock_getcpuclockid", "process " + std::to_string(pid));
  timespec used{};
  checkCall(::clock_gettime(clock, &used), "clock_gettime", "process " + std::to_string(pid));
  return static_cast<double>(used.tv_sec) * 1e9 + static_cast<double>(used.tv_nsec);
}

double residentBytesOf(int pid) {
  return static_cast<double>(valueIn(fileOf(pid, "status"), "VmRSS:").value_or(0)) * 1024;
}

}  // namespace mpf::bench
