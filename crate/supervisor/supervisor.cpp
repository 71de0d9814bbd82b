// SPDX-License-Identifier: MIT
#include "crate/supervisor/supervisor.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <mpf/clock.h>

#include "base/duration_text.h"
#include "base/print_error.h"
#include "base/service_manager.h"
#include "base/signal_name.h"
#include "base/system_call.h"

namespace mpf::crate {
namespace {

using std::chrono::milliseconds;

constexpr Nanoseconds kLookWhileStarting = milliseconds(20), kLook = milliseconds(1000);

void print(const std::vector<LogLimiter::Line>& lines) {
  for (const auto& line : lines) printError("mpf run: {}\n", line.text);
}

FileDescriptor createLocked(const CrateFolder& folder) {
  folder.create();
  return folder.lock();
}

}  // namespace

Supervisor::Supervisor(CrateFolder folder, std::function<Crate()> load)
    : folder_(std::move(folder)),
      lock_(createLocked(folder_)),
      load_(std::move(load)),
      crate_(load_()),
      logs_(::isatty(STDERR_FILENO) != 0, crate_.maxLogBytes),
      capsuleWriter_(folder_, crate_) {
  ::signal(SIGPIPE, SIG_IGN);  // stderr may be a pipe whose reader Ctrl-C has ended
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);  // reaps what the processes leave behind
  control_.listen(folder_);
  static_cast<void>(apply(planProcesses(crate_, folder_.path().string())));
  takeOver();
}

void Supervisor::log(const Service& service, const std::string& text) {
  printError("mpf run: {}: {}\n", service.plan().name, text);
}

void Supervisor::run() {
  const auto isRunning = [](const auto& member) { return member->service.isRunning(); };
  while (!isShuttingDown_ || std::ranges::any_of(members_, isRunning)) {
    act();
    reportStatus();
    wait();
  }
  tryRecord();
  do {
    writeError(logs_.takeLines());
  } while (logs_.hasMore() && errors_.isEmpty());
  print(problems_.takeAll(Clock::nowNs()));
  ::unlink(folder_.file("control").c_str());
}

void Supervisor::beginShutdown() {
  isShuttingDown_ = true;
  ServiceManager::notifyStopping();
}

Supervisor::Member* Supervisor::find(const std::string& name) {
  const auto found = std::ranges::find_if(members_, [&](const auto& member) {
    return member && !member->isRemoved && member->service.plan().name == name;
  });
  return found != members_.end() ? found->get() : nullptr;
}

bool Supervisor::areNeedsReady(const Service& service) const {
  const auto& plan = service.plan();
  return std::ranges::none_of(members_, [&](const auto& member) {
    const auto& other = member->service;
    if (member->isRemoved && other.plan().name == plan.name) return other.isRunning();
    return std::ranges::find(plan.needs, other.plan().name) != plan.needs.end() &&
           other.state() != ServiceState::ready;
  });
}

bool Supervisor::hasDependants(const Service& service) const {
  return std::ranges::any_of(members_, [&](const auto& member) {
    const auto& needs = member->service.plan().needs;
    return member->service.isRunning() &&
           std::ranges::find(needs, service.plan().name) != needs.end();
  });
}

// Performs the action of each service. During the shutdown, none starts, and each that runs stops
// after those that need it.
void Supervisor::act() {
  const auto now = Clock::nowNs();
  for (const auto& member : members_) {
    auto& service = member->service;
    if (isShuttingDown_ && !service.isStopRequested() &&
        (!service.isRunning() || !hasDependants(service)))
      service.requestStop(now);
    switch (service.action(areNeedsReady(service), now)) {
      case Action::start:
        start(*member);
        break;
      case Action::terminate:
        signal(*member, SIGTERM);
        break;
      case Action::kill:
        signal(*member, SIGKILL);
        break;
      case Action::none:
        break;
    }
  }
  std::erase_if(members_, [](const auto& member) {
    return member->isRemoved && !member->service.isRunning();
  });
}

void Supervisor::start(Member& member) {
  auto& service = member.service;
  const auto& plan = service.plan();
  try {
    auto& child = member.child.emplace(plan, folder_.log(plan.name), notify_.name());
    member.isNotified = false;
    service.started(child.pid(), child.startTicks(), Clock::nowNs());
    capsuleWriter_.watch(service);
    logs_.note(plan.name, fmt::format("started, pid {}", child.pid()));
    nextLookNs_ = 0;
    tryRecord();
    child.open();
  } catch (const std::exception& error) {
    failStart(member, error.what());
  }
}

void Supervisor::failStart(Member& member, const std::string& why) {
  auto& service = member.service;
  member.child.reset();
  capsuleWriter_.forget(service);  // its child, if there is one, ends by itself
  service.startFailed("cannot be started: " + why, Clock::nowNs());
  logs_.note(service.plan().name, service.reason());
  log(service, service.reason());
}

// After a stop was requested, the end of the child is that of the process.
void Supervisor::takeStart(Member& member) {
  const auto why = member.child ? member.child->tryResult() : std::nullopt;
  if (!why) return;
  member.child.reset();
  nextLookNs_ = 0;
  const auto& plan = member.service.plan();
  if (!why->empty() && member.service.state() == ServiceState::starting)
    failStart(member, fmt::format("{} in {}: {}", plan.command.front(), plan.workingFolder, *why));
}

void Supervisor::signal(Member& member, int number) {
  const auto& service = member.service;
  if (!service.isRunning()) return;
  log(service, fmt::format("{}; {}", service.reason(), signalName(number)));
  sendSignal(service.pid(), member.adopted, number);
}

void Supervisor::onStopSignal(int number) {
  printError("mpf run: {}: {}\n", signalName(number), isShuttingDown_ ? "killing all" : "stopping");
  if (!isShuttingDown_) return beginShutdown();
  for (const auto& member : members_) signal(*member, SIGKILL);
}

void Supervisor::handleSignals() {
  while (const auto number = signals_.take()) {
    switch (*number) {
      case SIGCHLD:
        reapChildren();
        break;
      case SIGHUP:
        try {
          reload();
        } catch (const std::exception& error) {
          printError("mpf run: not reloaded, nothing has changed:\n{}\n", error.what());
        }
        break;
      default:
        onStopSignal(*number);
        break;
    }
  }
}

// Also reaps processes that are not of the crate: they were left by others. What a process of the
// crate has left in its process group is killed; until it is reaped, no other group has its number.
void Supervisor::reapChildren() {
  while (const auto pid = endedChild()) {
    const auto member =
        std::ranges::find(members_, *pid, [](const auto& one) { return one->service.pid(); });
    if (member != members_.end()) ::kill(-*pid, SIGKILL);
    int status = 0;
    ::waitpid(*pid, &status, 0);
    if (member == members_.end()) continue;
    takeStart(**member);
    if ((*member)->service.pid() == *pid) handleEnd(**member, {status});
  }
}

// Many processes may end together, and the core of each may take seconds to read.
void Supervisor::handleEnd(Member& member, const ProcessEnd& end) {
  reportAlive();
  auto& service = member.service;
  const auto pid = service.pid();
  const auto aliveNs = static_cast<double>(Clock::nowNs() - service.startedNs());
  member.isAdopted = false;
  member.adopted.reset();
  attempt([&] { capsuleWriter_.look(); });
  const auto capsule = capsuleWriter_.collect(service, end);
  service.ended(end, Clock::nowNs());
  tryRecord();
  attempt([&] {
    for (const auto& [backplane, watch] : watches_) watch.removeFilesOfDead();
  });
  const auto willRestart =
      service.state() == ServiceState::pausing || service.state() == ServiceState::waiting;
  const auto next = willRestart ? fmt::format("restart {}", service.restarts())
                                : std::string(toString(service.state()));
  logs_.note(service.plan().name,
             fmt::format("{}; {}",
                         service.endReason() == EndReason::none
                             ? end.text()
                             : fmt::format("{}, {}", service.reason(), end.text()),
                         next));
  log(service, fmt::format("{} after {}, pid {}; {}{}", end.text(), durationText(aliveNs), pid,
                           next, capsule.empty() ? "" : "; see `mpf capsule " + capsule + "`"));
  if (service.state() == ServiceState::failed)
    log(service,
        fmt::format("failed: {}; `mpf logs {}` shows why", service.reason(), service.plan().name));
}

// Finds out which adopted processes without a pidfd have ended.
void Supervisor::lookForEnds() {
  for (const auto& member : members_) {
    const auto& service = member->service;
    if (!member->isAdopted || member->adopted) continue;
    if (startTicksOf(service.pid()) != service.startTicks()) handleEnd(*member, {});
  }
}

// Finds out which processes are ready, and which are stalled or busy.
void Supervisor::look() {
  attempt([&] { lookForEnds(); });
  attempt([&] {
    for (auto& [backplane, watch] : watches_) watch.look();
    capsuleWriter_.look();
  });
  if (errors_.isEmpty()) writeError(logs_.takeLines());
  logs_.maintain();
  if (!isRecorded_) tryRecord();
  const auto now = Clock::nowNs();
  print(problems_.takeDue(now));
  for (const auto& member : members_) {
    auto& service = member->service;
    const auto watch = watches_.find(service.plan().backplane);
    if (!service.isRunning() || watch == watches_.end()) continue;
    service.looked(watch->second.isStalled(service.pid()), watch->second.workOf(service.pid()),
                   now);
    if (service.state() != ServiceState::starting) continue;
    service.lacks(whatIsMissing(*member));
    if (!service.missing().empty()) continue;
    service.becameReady();
    log(service, fmt::format("ready, pid {}, {} after its start", service.pid(),
                             durationText(static_cast<double>(now - service.startedNs()))));
  }
  const auto isStarting = [](const auto& member) {
    return member->service.state() == ServiceState::starting;
  };
  const auto pause = std::ranges::any_of(members_, isStarting) ? kLookWhileStarting : kLook;
  nextLookNs_ = Clock::nowNs() + pause.count();
}

std::string Supervisor::whatIsMissing(const Member& member) const {
  const auto& plan = member.service.plan();
  if (member.child) return "its program is not executed yet: its user or its folder may be slow";
  if (plan.notifies && !member.isNotified) return "it has not reported that it is ready";
  const auto servers =
      watches_.at(plan.backplane).notServing(member.service.pid(), plan.location, plan.servers);
  if (servers.empty()) return {};
  return fmt::format("clients cannot bind to {} at location {}", fmt::join(servers, ", "),
                     plan.location);
}

void Supervisor::takeReports() {
  for (const auto pid : notify_.takeReady()) {
    for (const auto& member : members_) {
      if (member->service.pid() != pid || member->isNotified) continue;
      member->isNotified = true;
      nextLookNs_ = 0;
    }
  }
}

void Supervisor::noteProblem(std::string_view what) {
  if (problems_.admit({__FILE__, __LINE__}, 0, what, Clock::nowNs()))
    printError("mpf run: {}\n", what);
}

int Supervisor::waitMs() const {
  if (logs_.hasMore() && errors_.isEmpty()) return 0;
  auto next = nextLookNs_;
  for (const auto& member : members_) {
    if (const auto time = member->service.nextActionNs()) next = std::min(next, *time);
  }
  if (const auto watchdog = ServiceManager::watchdogTime())
    next = std::min(next, Clock::nowNs() + std::int64_t{watchdog->count()} * 1000 / 2);
  const auto left = std::chrono::ceil<milliseconds>(Nanoseconds(next - Clock::nowNs())).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, 60'000));
}

void Supervisor::wait() {
  std::vector<pollfd> polled{{signals_.descriptor(), POLLIN, 0},
                             {errors_.isEmpty() ? logs_.descriptor() : -1, POLLIN, 0},
                             {notify_.descriptor(), POLLIN, 0},
                             {errors_.descriptor(), POLLOUT, 0}};
  const auto firstAdopted = polled.size();
  std::vector<Member*> adopted;
  for (const auto& member : members_) {
    if (member->adopted.get() < 0) continue;
    adopted.push_back(member.get());
    polled.push_back({member->adopted.get(), POLLIN, 0});
  }
  for (const auto& member : members_)
    if (member->child) polled.push_back({member->child->descriptor(), POLLIN, 0});
  const auto firstWitness = static_cast<std::ptrdiff_t>(polled.size());
  capsuleWriter_.addTo(polled);
  const auto firstControl = static_cast<std::ptrdiff_t>(polled.size());
  control_.addTo(polled);
  ::poll(polled.data(), polled.size(), waitMs());

  for (std::size_t i = 0; i < adopted.size(); ++i)
    if (polled[firstAdopted + i].revents != 0) handleEnd(*adopted[i], {});
  for (const auto& member : members_) takeStart(*member);
  if (polled[0].revents != 0) handleSignals();
  if (nextLookNs_ == 0) look();  // first, so that the replies have the present states
  control_.handle({polled.begin() + firstControl, polled.end()});
  if (errors_.isEmpty() && (polled[1].revents != 0 || logs_.hasMore()))
    writeError(logs_.takeLines());  // otherwise the lines wait in their files
  if (polled[2].revents != 0) takeReports();
  if (polled[3].revents != 0) errors_.flush();
  if (std::any_of(polled.begin() + firstWitness, polled.begin() + firstControl,
                  [](const pollfd& one) { return one.revents != 0; }))
    attempt([&] { capsuleWriter_.look(); });
  if (Clock::nowNs() >= nextLookNs_) look();
}

void Supervisor::reportAlive() {
  if (ServiceManager::watchdogTime()) ServiceManager::notifyAlive();
}

// After act(): a process that still waits needs one that is not ready.
void Supervisor::reportStatus() {
  reportAlive();
  if (isShuttingDown_) ServiceManager::notifyStillStopping();
  std::size_t ready = 0;
  bool isSettled = true;
  std::string others;
  for (const auto& member : members_) {
    const auto& service = member->service;
    isSettled = isSettled && service.isSettled();
    if (service.state() == ServiceState::ready) ++ready;
    else others += fmt::format("; {} {}", service.plan().name, toString(service.state()));
  }
  const auto status = fmt::format("{} of {} processes ready{}", ready, members_.size(), others);
  if (status == status_) return;
  status_ = status;
  ServiceManager::notifyStatus(status);
  if (isSettled) ServiceManager::notifyReady();
}

}  // namespace mpf::crate
