// SPDX-License-Identifier: MIT
// Service: decides when one process of a crate is started, stopped and restarted. It starts and
// signals nothing itself: the supervisor tells it what happened, and does what action() returns.
//
//                 needs are ready         servers are bindable
//     waiting ──────────────────► starting ────────────────► ready
//        ▲                          │ ended, or too slow       │ ended, stalled, busy
//        │ pause is over            ▼                          │
//     pausing ◄────────────────── (ended) ◄────────────────────┘
//                                   │ too many restarts, or wrong arguments: failed
//     stopped ◄── stopping ◄──── a stop was requested, in any state
//
// Threads  one.
// Crash    plain data; what must survive the supervisor is in the CrateState.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "crate/config/process_plan.h"
#include "shm/handling.h"

namespace mpf::crate {

enum class ServiceState { waiting, starting, ready, stopping, pausing, failed, stopped };
[[nodiscard]] const char* toString(ServiceState state) noexcept;

// What the supervisor must do now.
enum class Action { none, start, terminate, kill };

// Why the supervisor ends a process.
enum class EndReason { none, stopRequest, restartRequest, stalled, busy, notReady };

// How a process ended.
struct ProcessEnd {
  std::optional<int> waitStatus;  // as from waitpid(); nothing: another supervisor started it
  [[nodiscard]] std::string text() const;  // "exit status 1", "SIGSEGV"
  [[nodiscard]] bool isBySignal() const noexcept;
  [[nodiscard]] bool hasExited(int status) const noexcept;
};

// The request that a server of a process works on.
struct Work {
  std::string server;
  Handling handling;
  std::int64_t forNs = 0;  // at least; until it was looked at last
};

class Service {
 public:
  explicit Service(ProcessPlan plan) : plan_(std::move(plan)) {}

  // ---- what happened; `nowNs` is CLOCK_MONOTONIC
  void started(pid_t pid, std::uint64_t startTicks, std::int64_t nowNs);
  // A process that an earlier supervisor started.
  void adopted(pid_t pid, std::uint64_t startTicks, int restarts, std::int64_t nowNs,
               std::int64_t startedNs);
  void startFailed(const std::string& why, std::int64_t nowNs);
  // While it is starting: what it lacks to be ready; empty: nothing.
  void lacks(std::string missing) { missing_ = std::move(missing); }
  void becameReady();
  void ended(const ProcessEnd& end, std::int64_t nowNs);
  //   isStalled  messages wait for a server of the process, and it takes none
  //   work       the request on which a server of the process has worked longest
  void looked(bool isStalled, std::optional<Work> work, std::int64_t nowNs);

  // ---- what is requested
  void requestStart();
  void requestStop(std::int64_t nowNs);
  void requestRestart(std::int64_t nowNs);

  // What must be done. The state changes with it: call it once, and do it.
  //   areNeedsReady  whether all processes that this one needs are ready
  [[nodiscard]] Action action(bool areNeedsReady, std::int64_t nowNs);
  // The next time at which action() may return something without an event; nullopt: never.
  [[nodiscard]] std::optional<std::int64_t> nextActionNs() const;

  [[nodiscard]] const ProcessPlan& plan() const noexcept { return plan_; }
  [[nodiscard]] ServiceState state() const noexcept { return state_; }
  // Whether the start of the crate is over for it: it is not starting or stopping, or has ended
  // before, and may do so for ever. One that still waits after action() waits for another one.
  [[nodiscard]] bool isSettled() const noexcept {
    return !recentEndsNs_.empty() ||
           (state_ != ServiceState::starting && state_ != ServiceState::stopping);
  }
  [[nodiscard]] bool isRunning() const noexcept { return pid_ != 0; }
  [[nodiscard]] bool isStopRequested() const noexcept { return isStopRequested_; }
  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  [[nodiscard]] std::uint64_t startTicks() const noexcept { return startTicks_; }
  [[nodiscard]] int restarts() const noexcept { return restarts_; }
  [[nodiscard]] std::int64_t startedNs() const noexcept { return startedNs_; }
  [[nodiscard]] bool isStalled() const noexcept { return stalledSinceNs_.has_value(); }
  // The request on which a server works for a long time; nullopt: on none.
  [[nodiscard]] const std::optional<Work>& work() const noexcept { return work_; }
  [[nodiscard]] const std::string& missing() const noexcept { return missing_; }
  // Why the supervisor ends the process that runs; none: it does not.
  [[nodiscard]] EndReason endReason() const noexcept { return endReason_; }
  // Whether a process that ends so was never ready, as the one before it, which ended in the same
  // way. Call before ended().
  [[nodiscard]] bool isRepeatedFailure(const ProcessEnd& end) const {
    return !wasReady_ && end.text() == failedStart_;
  }
  // Why it is not running, or was last restarted: "SIGSEGV", "stalled for 10 s".
  [[nodiscard]] const std::string& reason() const noexcept { return reason_; }

 private:
  void terminate(EndReason reason, const std::string& why, std::int64_t nowNs);
  void kill(EndReason reason, const std::string& why, std::int64_t nowNs);
  void plan(std::int64_t nowNs);  // of the next start, after an end
  [[nodiscard]] bool mayRestart(const ProcessEnd& end) const;
  [[nodiscard]] std::chrono::nanoseconds pause() const;

  ProcessPlan plan_;
  ServiceState state_ = ServiceState::waiting;
  bool isStopRequested_ = false;
  bool isRestartRequested_ = false;  // while stopping: starts again at once
  pid_t pid_ = 0;
  std::uint64_t startTicks_ = 0;
  int restarts_ = 0;
  std::deque<std::int64_t> recentEndsNs_;  // within the restart window
  std::int64_t startedNs_ = 0;
  std::int64_t readyAtLatestNs_ = 0;  // while starting
  std::string missing_;  // while starting
  std::int64_t nextStartNs_ = 0;  // while pausing
  std::int64_t killAtNs_ = 0;  // while stopping
  bool isSignalled_ = false;  // while stopping: SIGTERM was sent
  std::optional<std::int64_t> stalledSinceNs_;
  std::optional<Work> work_;  // for at least kBusyNs
  bool wasReady_ = false;  // the present process, or the last one
  std::string failedStart_;  // how the last process ended if it was never ready
  EndReason endReason_ = EndReason::none;
  std::string reason_;
};

}  // namespace mpf::crate
