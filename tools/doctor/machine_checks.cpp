// SPDX-License-Identifier: MIT
// Checks of processors and clocks, and runDoctorChecks().
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <set>
#include <sstream>

#include "tools/doctor/checks.h"

namespace mpf::tools {
namespace {

// How many numbers a list like "0-3,8" names; 0 when the text is not such a list.
std::size_t countOf(const std::string& list) {
  std::size_t count = 0;
  std::istringstream ranges(list);
  for (std::string range; std::getline(ranges, range, ',');) {
    std::size_t first = 0;
    std::size_t last = 0;
    std::istringstream numbers(range);
    if (!(numbers >> first)) return 0;
    last = first;
    if (numbers.get() == '-' && (!(numbers >> last) || last < first)) return 0;
    count += last - first + 1;
  }
  return count;
}

// How many processors' time a cgroup file grants: 2 for "200000 100000"; nullopt for no limit.
std::optional<double> quotaOf(const std::optional<std::string>& text) {
  std::istringstream words(text.value_or(""));
  double quota = 0;
  double period = 0;
  if (!(words >> quota >> period) || period <= 0 || quota <= 0) return std::nullopt;
  return quota / period;
}

// The lowest quota of the cgroup of this process and of the cgroups that contain it. For cgroup
// version 1, the quota of the container.
std::optional<double> cpuQuota(const Host& host) {
  std::optional<double> least;
  const auto narrow = [&](std::optional<double> quota) {
    if (quota && (!least || *quota < *least)) least = quota;
  };
  for (const auto& line : host.tryReadLines("proc/self/cgroup")) {
    if (!line.starts_with("0::/")) continue;
    for (std::filesystem::path group = line.substr(4);; group = group.parent_path()) {
      narrow(quotaOf(host.tryRead(("sys/fs/cgroup" / group / "cpu.max").string())));
      if (group.empty()) break;
    }
  }
  const std::string old = "sys/fs/cgroup/cpu/cpu.cfs_";
  narrow(quotaOf(host.tryRead(old + "quota_us").value_or("") + " " +
                 host.tryRead(old + "period_us").value_or("")));
  return least;
}

}  // namespace

const char* toString(Health health) noexcept {
  switch (health) {
    case Health::ok:
      return "ok";
    case Health::warning:
      return "warning";
    case Health::problem:
      return "problem";
    case Health::unknown:
      return "unknown";
  }
  return "unknown";
}

Finding checkCpus(const Host& host) {
  constexpr const char* kName = "processors";
  const auto allowed = countOf(host.ofProcess("Cpus_allowed_list").value_or(""));
  if (allowed == 0) return {kName, Health::unknown, "/proc/self/status cannot be read", {}};
  const auto quota = cpuQuota(host);
  const auto seen =
      fmt::format("{} allowed{}", allowed, quota ? fmt::format(", time of {:.3g}", *quota) : "");
  if (allowed > 1 && (!quota || *quota >= 2)) return {kName, Health::ok, seen, {}};
  return {kName, Health::warning,
          seen + ": a process that spins takes the processor from the process that it waits for",
          "allow two (taskset, AllowedCPUs=, CPUQuota=, --cpus); or --wait-mode block for servers, "
          "WaitMode::block for clients"};
}

Finding checkClock(const Host& host) {
  constexpr const char* kName = "clock";
  const std::string folder = "sys/devices/system/clocksource/clocksource0/";
  const auto current = host.tryRead(folder + "current_clocksource");
  if (!current) return {kName, Health::unknown, "the kernel does not show its clock source", {}};
  static const std::set<std::string> kSlow{"hpet", "acpi_pm",         "jiffies",
                                           "pit",  "refined-jiffies", "xen"};
  if (!kSlow.contains(*current)) return {kName, Health::ok, *current, {}};
  const auto others = host.tryRead(folder + "available_clocksource").value_or("");
  return {kName, Health::warning,
          *current +
              ": reading the time is a system call, which adds about 1 us to each timed "
              "message",
          others.find("tsc") != std::string::npos
              ? "echo tsc > /" + folder + "current_clocksource; kernel parameter clocksource=tsc"
              : "kernel parameter tsc=reliable, if the TSC of this hardware is reliable; clocks "
                "available here: " +
                    others};
}

Finding checkGovernor(const Host& host) {
  constexpr const char* kName = "frequency governor";
  std::set<std::string> governors;
  const std::string folder = "sys/devices/system/cpu/cpufreq";
  for (const auto& policy : host.list(folder)) {
    if (const auto governor = host.tryRead(fmt::format("{}/{}/scaling_governor", folder, policy)))
      governors.insert(*governor);
  }
  if (governors.empty())
    return {kName,
            Health::unknown,
            "the kernel does not set the frequency, as in most virtual machines",
            {}};
  std::string seen;
  for (const auto& governor : governors) seen += (seen.empty() ? "" : ", ") + governor;
  if (governors == std::set<std::string>{"performance"}) return {kName, Health::ok, seen, {}};
  return {kName, Health::warning,
          seen +
              ": a processor that wakes up runs slowly at first, which delays replies to rare "
              "requests",
          "cpupower frequency-set --governor performance"};
}

std::vector<Finding> runDoctorChecks(const Host& host) {
  std::vector<Finding> findings;
  for (const auto check :
       {checkMount, checkSpace, checkRights, checkSegments, checkNamespaces, checkRemoveIpc,
        checkHidepid, checkPidfd, checkOpenFiles, checkMaps, checkAddressSpace, checkInotify,
        checkRealTime, checkCpus, checkClock, checkGovernor, checkServers, checkRouters}) {
    findings.push_back(check(host));
  }
  return findings;
}

}  // namespace mpf::tools
