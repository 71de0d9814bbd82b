// SPDX-License-Identifier: MIT
#include "benchmarks/stage/machine.h"

#include <sys/utsname.h>

#include <cstdlib>
#include <fmt/format.h>
#include <fstream>

namespace mpf::bench {
namespace {

std::string readLine(const std::string& path) {
  std::string line;
  std::ifstream file(path);
  std::getline(file, line);
  return line;
}

// The value of a line "key : value" of /proc/cpuinfo.
std::string cpuInfo(std::string_view key) {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(key)) continue;
    const auto colon = line.find(": ");
    return colon == std::string::npos ? "" : line.substr(colon + 2);
  }
  return "";
}

std::string cpuFile(int cpu, const char* file) {
  return readLine(fmt::format("/sys/devices/system/cpu/cpu{}/{}", cpu, file));
}

std::string placementText(const Placement& at) {
  const auto same = [&](const char* file) {
    const auto mine = cpuFile(at.server.front(), file);
    return !mine.empty() && mine == cpuFile(at.requester.front(), file);
  };
  const char* cores =
      same("topology/thread_siblings_list") ? "two threads of one core" : "separate cores";
  const char* cache = same("cache/index3/shared_cpu_list")   ? ", one last-level cache"
                      : same("topology/physical_package_id") ? ", one socket"
                                                             : ", different sockets";
  if (at.server == at.requester)
    return fmt::format("CPU {}: server and requester", toString(at.server));
  return fmt::format("CPUs {} (server) and {} (requester): {}{}", toString(at.server),
                     toString(at.requester), cores, cache);
}

}  // namespace

Machine Machine::look(const Placement& placement) {
  Machine machine;
  machine.cpu = cpuInfo("model name");
  if (machine.cpu.empty()) machine.cpu = "unknown CPU";
  utsname system{};
  ::uname(&system);
  machine.kernel = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
  machine.governor = cpuFile(placement.requester.front(), "cpufreq/scaling_governor");
  if (machine.governor.empty()) machine.governor = "unknown";
  machine.placement = placementText(placement);
  machine.isVirtual =
      fmt::format(" {} ", cpuInfo("flags")).find(" hypervisor ") != std::string::npos;
  if (::getloadavg(&machine.load, 1) != 1) machine.load = 0;
  return machine;
}

std::string Machine::text() const {
  return fmt::format("{}, {}{}, governor {}, load {:.2f}\n{}", cpu, kernel,
                     isVirtual ? ", virtual machine" : "", governor, load, placement);
}

}  // namespace mpf::bench
