// SPDX-License-Identifier: MIT
// Dispatcher::Impl: the endpoint of the clients of a process, and the work that is due for them.
//
// Threads  the thread that holds the RunnerLock, unless a comment says that any thread may call.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <mpf/dispatcher.h>

#include "client/binding.h"
#include "client/callback_errors.h"
#include "client/round.h"
#include "client/runner_lock.h"

namespace mpf {

class Dispatcher::Impl {
 public:
  // How often a waiting thread checks whether another thread still runs the dispatcher.
  static constexpr Nanoseconds kLookForRunner = std::chrono::milliseconds(5);

  Impl(Backplane backplane, const DispatcherOptions& options);
  ~Impl();

  // The thread keeps `self` alive.
  void startThread(const std::shared_ptr<Impl>& self);
  void endThread();

  // --- any thread, as long as no other thread runs the dispatcher ---
  // Makes the calling thread the runner until the guard ends. Changes nothing when the thread
  // already has the lock.
  //   throws  std::logic_error when another thread runs the dispatcher
  [[nodiscard]] RunnerGuard becomeRunner();
  bool runOnce(Deadline deadline);
  bool runPending(int most);
  int descriptor();
  // Runs until `isDone` or the deadline, or until another thread wants to run the dispatcher.
  // Returns false, and runs nothing, when callbacks belong on another thread.
  [[nodiscard]] bool tryRunUntil(Deadline deadline, const std::function<bool()>& isDone);

  // --- any thread ---
  void interrupt() noexcept;
  [[nodiscard]] Deadline nextDue() const noexcept {
    // PAIR(waiting-thread): read after the waiting thread has stored its id in waitingThread_.
    return Deadline::atNs(dueNs_.load(std::memory_order_seq_cst));
  }
  // Runs `command`, which may run callbacks, on the thread that runs the dispatcher: now when that
  // is the calling thread, else in the next step.
  void post(std::function<void()> command);
  // Runs `command` in the next step, after the callback that is in progress has returned.
  void postLater(std::function<void()> command);
  // Runs `command`, which runs no callback: now when no other thread runs the dispatcher, else in
  // the next step.
  void runOrPost(const std::function<void()>& command);
  // As runOrPost(), and waits until the command has run.
  void runOrPostAndWait(const std::function<void()>& command);
  // Makes sure that the dispatcher wakes up at `ns`.
  void noteDue(std::int64_t ns) noexcept;

  Endpoint& endpoint() noexcept { return endpoint_; }
  void add(const std::shared_ptr<Binding>& binding);
  // The binding stays alive until no callback of it can be in progress.
  void remove(const std::shared_ptr<Binding>& binding);
  void setLink(std::uint32_t index, Binding* binding);
  // Starts or ends the watch for new servers, which bindings without a server need.
  void waitForNames(bool wait);

  // True for a shared dispatcher: only its own thread runs it.
  [[nodiscard]] bool hasThread() const noexcept { return hasThread_; }
  // Called in a catch clause: the callback of a client of that server has thrown.
  void noteThrower(const std::string& server, std::int32_t location) noexcept;

 private:
  RunnerGuard acquireLock();
  template <class IsOver>
  bool run(Deadline deadline, const IsOver& isOver);
  bool takeStop() noexcept;
  bool step();
  bool tryStep();
  void dropKnocks() noexcept;
  bool handleLocalHints();
  bool resumeRounds();
  void handleDue();
  void runCommands();
  std::function<void()> takeCommand();

  Endpoint endpoint_;
  std::set<std::shared_ptr<Binding>> bindings_;
  std::vector<std::shared_ptr<Binding>> removed_;
  std::vector<Binding*> byIndex_;
  std::mutex commandMutex_;
  std::deque<std::function<void()>> commands_;  // under commandMutex_
  std::atomic<bool> hasCommands_{false};
  std::atomic<bool> namesChanged_{false};
  Round dead_;  // of bindings whose server may have died
  Round waiting_;  // of bindings whose server may have appeared
  Round due_;  // of bindings with work that is due
  Watcher::Token namesToken_ = 0;
  std::atomic<std::int64_t> dueNs_{INT64_MAX};
  std::atomic<bool> stop_{false};
  std::atomic<bool> ended_{false};
  RunnerLock lock_;
  // The thread that waits in run(), or waited there last.
  std::atomic<std::thread::id> waitingThread_;
  CallbackErrors errors_;
  int depth_ = 0;  // of nested steps: a callback may run the dispatcher
  bool hasDescriptor_ = false;
  bool hasThread_ = false;
  std::thread thread_;
};

}  // namespace mpf
