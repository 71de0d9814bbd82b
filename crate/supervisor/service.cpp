// SPDX-License-Identifier: MIT
#include "crate/supervisor/service.h"

#include <sys/wait.h>

#include <algorithm>
#include <fmt/format.h>

#include "base/duration_text.h"
#include "base/run_main.h"
#include "base/signal_name.h"
#include "tools/report/snapshot_delta.h"

namespace mpf::crate {
namespace {

constexpr std::int64_t kBusyNs = 1'000'000'000;

std::int64_t nanoseconds(std::chrono::nanoseconds time) { return time.count(); }

}  // namespace

const char* toString(ServiceState state) noexcept {
  switch (state) {
    case ServiceState::waiting:
      return "waiting";
    case ServiceState::starting:
      return "starting";
    case ServiceState::ready:
      return "ready";
    case ServiceState::stopping:
      return "stopping";
    case ServiceState::pausing:
      return "pausing";
    case ServiceState::failed:
      return "failed";
    case ServiceState::stopped:
      break;
  }
  return "stopped";
}

std::string ProcessEnd::text() const {
  if (!waitStatus) return "ended (exit status unknown: an earlier supervisor started it)";
  if (WIFSIGNALED(*waitStatus)) return signalName(WTERMSIG(*waitStatus));
  return fmt::format("exit status {}", WEXITSTATUS(*waitStatus));
}

bool ProcessEnd::isBySignal() const noexcept { return waitStatus && WIFSIGNALED(*waitStatus); }

bool ProcessEnd::hasExited(int status) const noexcept {
  return waitStatus && WIFEXITED(*waitStatus) && WEXITSTATUS(*waitStatus) == status;
}

void Service::started(pid_t pid, std::uint64_t startTicks, std::int64_t nowNs) {
  pid_ = pid;
  startTicks_ = startTicks;
  startedNs_ = nowNs;
  readyAtLatestNs_ = nowNs + nanoseconds(plan_.startTime);
  isRestartRequested_ = false;
  wasReady_ = false;
  endReason_ = EndReason::none;
  missing_.clear();
  stalledSinceNs_.reset();
  work_.reset();
}

void Service::adopted(pid_t pid, std::uint64_t startTicks, int restarts, std::int64_t nowNs,
                      std::int64_t startedNs) {
  started(pid, startTicks, nowNs);
  startedNs_ = startedNs;
  restarts_ = restarts;
  state_ = ServiceState::starting;
}

void Service::startFailed(const std::string& why, std::int64_t nowNs) {
  pid_ = 0;  // the end of a child that was started is no further failure
  startTicks_ = 0;
  reason_ = why;
  plan(nowNs);
}

void Service::becameReady() {
  if (state_ != ServiceState::starting) return;
  state_ = ServiceState::ready;
  wasReady_ = true;
}

void Service::ended(const ProcessEnd& end, std::int64_t nowNs) {
  pid_ = 0;
  stalledSinceNs_.reset();
  work_.reset();
  failedStart_ = wasReady_ ? "" : end.text();
  // The reason of a restart that the supervisor decided stays.
  if (state_ != ServiceState::stopping) reason_ = end.text();
  if (isStopRequested_) {
    state_ = ServiceState::stopped;
  } else if (isRestartRequested_) {
    ++restarts_;
    state_ = ServiceState::waiting;
  } else if (state_ == ServiceState::stopping) {  // stalled, busy, or not ready in time
    if (plan_.restart == Restart::never) state_ = ServiceState::failed;
    else plan(nowNs);
  } else if (!mayRestart(end)) {
    const auto isOver = plan_.restart == Restart::never || end.hasExited(0);
    state_ = isOver ? ServiceState::stopped : ServiceState::failed;
  } else {
    plan(nowNs);
  }
}

bool Service::mayRestart(const ProcessEnd& end) const {
  if (plan_.restart == Restart::never) return false;
  if (plan_.restart == Restart::onFailure && end.hasExited(0)) return false;
  return !end.hasExited(kExitUsage);  // it would fail again
}

void Service::plan(std::int64_t nowNs) {
  recentEndsNs_.push_back(nowNs);
  while (recentEndsNs_.front() < nowNs - nanoseconds(plan_.restartWindow))
    recentEndsNs_.pop_front();
  if (recentEndsNs_.size() > static_cast<std::size_t>(plan_.maxRestarts)) {
    state_ = ServiceState::failed;
    reason_ += fmt::format("; it ended {} times within {}", recentEndsNs_.size(),
                           durationText(static_cast<double>(nanoseconds(plan_.restartWindow))));
    return;
  }
  ++restarts_;
  nextStartNs_ = nowNs + nanoseconds(pause());
  state_ = ServiceState::pausing;
}

std::chrono::nanoseconds Service::pause() const {
  auto pause = plan_.firstPause;
  for (std::size_t i = 1; i < recentEndsNs_.size() && pause < plan_.lastPause; ++i) pause *= 2;
  return std::min(pause, plan_.lastPause);
}

void Service::looked(bool isStalled, std::optional<Work> work, std::int64_t nowNs) {
  const auto isReady = state_ == ServiceState::ready;
  if (!isStalled || !isReady) stalledSinceNs_.reset();
  else if (!stalledSinceNs_) stalledSinceNs_ = nowNs;
  const auto limit = nanoseconds(plan_.busyLimit);
  if (work && isReady && limit != 0 && work->forNs >= limit)
    kill(EndReason::busy, "busy with " + tools::workText(work->handling, work->forNs), nowNs);
  work_.reset();
  if (work && state_ == ServiceState::ready && work->forNs >= kBusyNs) work_ = std::move(work);
}

void Service::terminate(EndReason reason, const std::string& why, std::int64_t nowNs) {
  reason_ = why;
  if (!isRunning()) return;
  if (state_ == ServiceState::stopping) return;
  state_ = ServiceState::stopping;
  endReason_ = reason;
  isSignalled_ = false;
  killAtNs_ = nowNs + nanoseconds(plan_.stopTime);
}

// For a process with a server that takes no messages: it does not handle SIGTERM, either.
void Service::kill(EndReason reason, const std::string& why, std::int64_t nowNs) {
  terminate(reason, why, nowNs);
  killAtNs_ = nowNs;
}

void Service::requestStart() {
  isRestartRequested_ = isRunning() && (isStopRequested_ || isRestartRequested_);
  isStopRequested_ = false;
  recentEndsNs_.clear();
  if (!isRunning()) state_ = ServiceState::waiting;
}

void Service::requestStop(std::int64_t nowNs) {
  isStopRequested_ = true;
  isRestartRequested_ = false;
  terminate(EndReason::stopRequest, "stopped by request", nowNs);
  if (!isRunning()) state_ = ServiceState::stopped;
}

void Service::requestRestart(std::int64_t nowNs) {
  if (!isRunning()) return requestStart();
  isStopRequested_ = false;
  isRestartRequested_ = true;
  recentEndsNs_.clear();
  terminate(EndReason::restartRequest, "restarted by request", nowNs);
}

Action Service::action(bool areNeedsReady, std::int64_t nowNs) {
  switch (state_) {
    case ServiceState::pausing:
      if (nowNs < nextStartNs_) return Action::none;
      state_ = ServiceState::waiting;
      [[fallthrough]];
    case ServiceState::waiting:
      if (!areNeedsReady) return Action::none;
      state_ = ServiceState::starting;
      return Action::start;
    case ServiceState::starting:
      if (nowNs >= readyAtLatestNs_) {
        terminate(EndReason::notReady,
                  fmt::format("not ready within {}{}{}",
                              durationText(static_cast<double>(nanoseconds(plan_.startTime))),
                              missing_.empty() ? "" : ": ", missing_),
                  nowNs);
      }
      break;
    case ServiceState::ready:
      if (stalledSinceNs_ && plan_.stallLimit.count() != 0 &&
          nowNs >= *stalledSinceNs_ + nanoseconds(plan_.stallLimit)) {
        kill(EndReason::stalled,
             fmt::format("stalled for {}",
                         durationText(static_cast<double>(nowNs - *stalledSinceNs_))),
             nowNs);
      }
      break;
    default:
      break;
  }
  if (state_ != ServiceState::stopping) return Action::none;
  if (nowNs >= killAtNs_) {
    killAtNs_ = nowNs + nanoseconds(plan_.stopTime);  // again, if it is still there
    isSignalled_ = true;
    return Action::kill;
  }
  if (isSignalled_) return Action::none;
  isSignalled_ = true;
  return Action::terminate;
}

std::optional<std::int64_t> Service::nextActionNs() const {
  switch (state_) {
    case ServiceState::pausing:
      return nextStartNs_;
    case ServiceState::starting:
      return readyAtLatestNs_;
    case ServiceState::stopping:
      return isSignalled_ ? killAtNs_ : 0;
    case ServiceState::ready:
      if (stalledSinceNs_ && plan_.stallLimit.count() != 0)
        return *stalledSinceNs_ + nanoseconds(plan_.stallLimit);
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

}  // namespace mpf::crate
