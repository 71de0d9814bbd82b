// SPDX-License-Identifier: MIT
// Checks of what the kernel shows and grants to processes.
#include <cstdlib>
#include <fmt/format.h>

#include <mpf/real_time_priority.h>

#include "tools/doctor/checks.h"

namespace mpf::tools {
namespace {

// A warning when `value` is below `enough`; `purpose` says what the limit is needed for.
Finding checkAtLeast(const char* name, std::optional<std::uint64_t> value, std::uint64_t enough,
                     const std::string& purpose, const std::string& remedy, const char* unit = "") {
  if (!value) return {name, Health::unknown, "the limit cannot be read", {}};
  if (*value == UINT64_MAX) return {name, Health::ok, "no limit", {}};
  if (*value >= enough) return {name, Health::ok, fmt::to_string(*value), {}};
  return {name, Health::warning, fmt::format("{}{}: {}", *value, unit, purpose), remedy};
}

bool hasCapability(const Host& host, unsigned number) {
  const auto text = host.ofProcess("CapEff");
  if (!text) return false;
  return (std::strtoull(text->c_str(), nullptr, 16) >> number & 1) != 0;
}

}  // namespace

Finding checkHidepid(const Host& host) {
  constexpr const char* kName = "mount of /proc";
  const auto mount = host.mountAt("/proc");
  if (!mount) return {kName, Health::unknown, "/proc is not mounted", {}};
  const auto hidepid = mount->options.find("hidepid");
  if (hidepid == mount->options.end() || hidepid->second == "0" || hidepid->second == "off")
    return {kName, Health::ok, "shows the processes of all users", {}};
  return {kName, Health::warning,
          fmt::format("hidepid={}: the death of another user's process is detected up to 0.1 s "
                      "later, and reports cannot show whether it is stopped",
                      hidepid->second),
          "mount -o remount,hidepid=0 /proc, or gid=GROUP with the group of the users of MPF"};
}

Finding checkPidfd(const Host& host) {
  constexpr const char* kName = "pidfd";
  const auto kernel = host.tryRead("proc/sys/kernel/osrelease").value_or("unknown");
  if (host.hasPidfd()) return {kName, Health::ok, "kernel " + kernel, {}};
  return {
      kName, Health::warning,
      fmt::format("kernel {} has no pidfd_open, or a sandbox forbids it: the death of a process is "
                  "detected up to 0.1 s later",
                  kernel),
      "use kernel 5.3 or newer; containers: a seccomp profile that allows pidfd_open"};
}

Finding checkOpenFiles(const Host& host) {
  return checkAtLeast(
      "limit of open files", host.limit("Max open files"), 1024,
      "a program needs two or three descriptors for each process that it communicates with",
      "ulimit -n 4096; LimitNOFILE=4096 in the systemd unit; nofile in /etc/security/limits.conf");
}

Finding checkMaps(const Host& host) {
  return checkAtLeast("limit of mappings", host.number("proc/sys/vm/max_map_count"), 65530,
                      "each link needs one mapping, and each of its pools another",
                      "sysctl vm.max_map_count=262144");
}

Finding checkAddressSpace(const Host& host) {
  return checkAtLeast("limit of address space", host.limit("Max address space"),
                      std::uint64_t{4} << 30, "every mapped segment counts towards it",
                      "ulimit -v unlimited", " bytes");
}

Finding checkInotify(const Host& host) {
  return checkAtLeast(
      "inotify instances", host.number("proc/sys/fs/inotify/max_user_instances"), 128,
      "each process that waits for an absent server needs one; without one it looks every 0.1 s",
      "sysctl fs.inotify.max_user_instances=512");
}

Finding checkRealTime(const Host& host) {
  constexpr const char* kName = "real-time priority";
  constexpr unsigned kSysNice = 23;  // CAP_SYS_NICE
  const auto limit = host.limit("Max realtime priority");
  if (host.tryRead("proc/sys/kernel/sched_rt_runtime_us") == "0") {
    return {kName, Health::warning,
            "the kernel gives real-time threads no processor time: device servers use ordinary "
            "threads",
            "sysctl kernel.sched_rt_runtime_us=950000"};
  }
  if (hasCapability(host, kSysNice)) return {kName, Health::ok, "allowed by CAP_SYS_NICE", {}};
  if (!limit) return {kName, Health::unknown, "the limit cannot be read", {}};
  if (*limit >= kInterruptPriority)
    return {kName, Health::ok, fmt::format("allowed up to {} by RLIMIT_RTPRIO", *limit), {}};
  return {kName, Health::warning,
          fmt::format("this user may have priority {}, device servers request {}: on busy "
                      "processors interrupts wait, and an octal UART loses characters when an "
                      "interrupt waits for a millisecond",
                      *limit, kInterruptPriority),
          fmt::format("LimitRTPRIO={0} or AmbientCapabilities=CAP_SYS_NICE in the systemd unit; "
                      "\"USER - rtprio {0}\" in a file of /etc/security/limits.d, then log in "
                      "again",
                      kInterruptPriority)};
}

}  // namespace mpf::tools
