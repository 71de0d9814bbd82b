// SPDX-License-Identifier: MIT
#include "epics/stopped_processes.h"

#include <utility>

#include "base/process_stat.h"
#include "shm/process.h"

namespace mpf {
namespace {

// Whether /proc shows the processes of our pid namespace.
bool isProcOurs() noexcept {
  const auto& self = Process::self();
  const auto stat = ProcessStat::tryRead(self.pid);
  return stat && stat->number(ProcessStat::kStartTicks) == self.startTicks;
}

}  // namespace

void StoppedProcesses::look(const std::set<std::int32_t>& pids) {
  const auto before = std::exchange(ticks_, {});
  stopped_.clear();
  if (pids.empty() || !isProcOurs()) return;
  for (const auto pid : pids) {
    const auto stat = ProcessStat::tryRead(pid);
    if (!stat || !isStopped(stat->state())) continue;
    const auto ticks =
        stat->number(ProcessStat::kUserTicks) + stat->number(ProcessStat::kSystemTicks);
    ticks_[pid] = ticks;
    if (const auto was = before.find(pid); was != before.end() && was->second == ticks)
      stopped_.insert(pid);
  }
}

}  // namespace mpf
