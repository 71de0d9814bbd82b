// SPDX-License-Identifier: MIT
// Supervisor: the record of its processes, from which the next supervisor takes them over.
#include <fmt/format.h>

#include <mpf/clock.h>

#include "base/printable.h"
#include "crate/supervisor/child_process.h"
#include "crate/supervisor/supervisor.h"

namespace mpf::crate {
namespace {

// Texts of a record. JSON cannot hold bytes that are not UTF-8, such as those of a file's name.
std::string commandOf(const ProcessPlan& plan) { return printable(shellText(plan)); }
std::string contextOf(const ProcessPlan& plan) { return printable(contextText(plan)); }

bool hasChanged(const RecordedProcess& process, const ProcessPlan& plan) {
  return process.command != commandOf(plan) ||
         (!process.context.empty() && process.context != contextOf(plan));
}

}  // namespace

// Each process that an earlier supervisor has started and that still runs is supervised again. One
// that the crate has no more, or with another command line or changed files, is ended.
void Supervisor::takeOver() {
  for (const auto& recorded : CrateState::read(folder_.file("state.json")).processes) {
    auto* member = find(recorded.name);
    auto pidfd = openPidfd(recorded.pid);
    const auto startTicks = startTicksOf(recorded.pid);
    if (startTicks == 0 || startTicks != recorded.startTicks) {  // it has ended
      if (member != nullptr && recorded.isStopRequested)
        member->service.requestStop(Clock::nowNs());
      continue;
    }
    if (member == nullptr) {
      ProcessPlan plan;
      plan.name = recorded.name;
      member = members_.emplace_back(std::make_unique<Member>(plan)).get();
      member->isRemoved = true;
    }
    auto& service = member->service;
    member->isAdopted = true;
    member->adopted = std::move(pidfd);
    member->isNotified = true;
    service.adopted(recorded.pid, recorded.startTicks, recorded.restarts, Clock::nowNs(),
                    startNsOf(recorded.startTicks));
    capsuleWriter_.watch(service);
    log(service, fmt::format("taken over, pid {}", recorded.pid));
    if (member->isRemoved || recorded.isStopRequested) service.requestStop(Clock::nowNs());
    else if (hasChanged(recorded, service.plan())) service.requestRestart(Clock::nowNs());
  }
}

void Supervisor::record() const {
  CrateState state;
  state.file = crate_.file;
  for (const auto& member : members_) {
    const auto& service = member->service;
    state.processes.push_back({service.plan().name, service.pid(), service.startTicks(),
                               service.restarts(), commandOf(service.plan()),
                               service.isStopRequested() && !isShuttingDown_ && !member->isRemoved,
                               contextOf(service.plan())});
  }
  state.write(folder_.file("state.json"));
}

void Supervisor::tryRecord() {
  isRecorded_ = attempt([&] { record(); });
}

}  // namespace mpf::crate
