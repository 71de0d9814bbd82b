// SPDX-License-Identifier: MIT
// Supervisor: starts the processes of a crate, watches them, restarts those that end or stall, and
// stops them in order. It is on the path of no message.
//
//   signals, ends of processes ─┐                       ┌─► ChildProcess, signals to processes
//   requests (mpf stop, ...) ───┼─► Service::action() ──┤
//   ServerWatch, time ──────────┘                       └─► CrateState, log, systemd
//
// Threads  one, and the process may have no other, because it forks.
// Crash    the processes continue. The next supervisor of the crate finds them in the CrateState
//          and takes them over.
#pragma once

#include <signal.h>

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/error_queue.h"
#include "base/log_limiter.h"
#include "crate/supervisor/capsule_writer.h"
#include "crate/supervisor/child_process.h"
#include "crate/supervisor/control_server.h"
#include "crate/supervisor/crate_state.h"
#include "crate/supervisor/log_follower.h"
#include "crate/supervisor/notify_socket.h"
#include "crate/supervisor/server_watch.h"
#include "crate/supervisor/service.h"
#include "crate/supervisor/signal_queue.h"

namespace mpf::crate {

class Supervisor {
 public:
  // Locks the folder, and takes over the processes that an earlier supervisor has left.
  //   load    reads the crate; called at the start, when the folder is locked, and for each reload
  //   throws  ConfigError, std::runtime_error, std::system_error
  Supervisor(CrateFolder folder, std::function<Crate()> load);
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  // Runs until SIGINT, SIGTERM or the request "shutdown"; returns when all processes have ended.
  // SIGHUP reloads the crate.
  void run();

 private:
  struct Member {  // a service with what the supervisor holds for it
    explicit Member(ProcessPlan plan) : service(std::move(plan)) {}
    Service service;
    std::optional<ChildProcess> child;  // until its program is executed
    bool isAdopted = false;  // its process is not a child
    FileDescriptor adopted;  // pidfd of that process, if it could be opened
    bool isNotified = false;  // it has reported that it is ready
    bool isRemoved = false;  // no longer in the crate: forgotten when it has ended
  };

  static void log(const Service& service, const std::string& text);
  void takeOver();
  std::vector<std::string> apply(const std::vector<ProcessPlan>& plans);
  std::vector<std::string> reload();
  void beginShutdown();
  void onStopSignal(int number);
  void act();
  void start(Member& member);
  void failStart(Member& member, const std::string& why);
  void takeStart(Member& member);  // whether its program is executed
  void signal(Member& member, int number);
  void handleSignals();
  void reapChildren();
  void handleEnd(Member& member, const ProcessEnd& end);
  void lookForEnds();
  void look();
  // Why a process that runs is not ready; empty: it is.
  [[nodiscard]] std::string whatIsMissing(const Member& member) const;
  void takeReports();
  void record() const;
  void tryRecord();  // again at the next look, if it fails
  // Does what may fail, for example without a free descriptor, and must not end the supervision.
  // Returns whether it was done.
  template <class Act>
  bool attempt(const Act& act) try {
    act();
    return true;
  } catch (const std::exception& error) {
    noteProblem(error.what());
    return false;
  }
  void noteProblem(std::string_view what);
  nlohmann::json answer(const nlohmann::json& request);
  [[nodiscard]] nlohmann::json describe() const;
  void wait();
  [[nodiscard]] int waitMs() const;
  static void reportAlive();
  void reportStatus();
  [[nodiscard]] bool areNeedsReady(const Service& service) const;
  // Whether a process that runs needs this one.
  [[nodiscard]] bool hasDependants(const Service& service) const;
  // A member that apply() has moved already is not found.
  Member* find(const std::string& name);
  Member& memberOf(const nlohmann::json& request);

  ErrorQueue errors_;  // first, because constructors and destructors print, too
  CrateFolder folder_;
  FileDescriptor lock_;
  std::function<Crate()> load_;
  Crate crate_;
  SignalQueue signals_{SIGINT, SIGTERM, SIGHUP, SIGCHLD};
  std::vector<std::unique_ptr<Member>> members_;  // each after those that it needs
  std::map<std::string, ServerWatch> watches_;  // by backplane
  LogFollower logs_;
  CapsuleWriter capsuleWriter_;
  NotifySocket notify_;
  ControlServer control_{[this](const auto& request) { return answer(request); }};
  std::int64_t nextLookNs_ = 0;
  std::string status_;  // as last reported to systemd
  LogLimiter problems_;  // what attempt() reports
  bool isRecorded_ = true;  // the file has the present state
  bool isShuttingDown_ = false;
};

}  // namespace mpf::crate
