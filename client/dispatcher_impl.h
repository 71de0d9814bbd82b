// SPDX-License-Identifier: MIT
// Dispatcher::Impl: the endpoint of a process's clients, and what is due for them.
//
// Threads  the thread that has the RunnerLock, unless a function says that any thread may call it.
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
  // Between looks whether another thread still runs a dispatcher without a thread of its own.
  static constexpr Nanoseconds kLookForRunner = std::chrono::milliseconds(5);

  Impl(Backplane backplane, const DispatcherOptions& options);
  ~Impl();

  // The thread keeps `self` alive.
  void startThread(const std::shared_ptr<Impl>& self);
  void endThread();

  // --- any thread, as long as no other thread runs the dispatcher ---
  // Makes the calling thread the runner until the guard ends; changes nothing when it has the lock
  // already.
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
    // PAIR(waiting-thread): after the name of the thread that waits until then.
    return Deadline::atNs(dueNs_.load(std::memory_order_seq_cst));
  }
  // Runs `command`, which may call back, on the thread that runs the dispatcher: now when that is
  // the calling thread, else in the next step.
  void post(std::function<void()> command);
  // In the next step, and not before the callback that is running has returned.
  void postLater(std::function<void()> command);
  // Runs `command`, which calls no callback: now when no other thread runs the dispatcher, else in
  // the next step.
  void runOrPost(const std::function<void()>& command);
  // The same, and waits until it has run.
  void runOrPostAndWait(const std::function<void()>& command);
  // Something is due at `ns`.
  void noteDue(std::int64_t ns) noexcept;

  Endpoint& endpoint() noexcept { return endpoint_; }
  void add(const std::shared_ptr<Binding>& binding);
  // The binding lives until no callback of it can be running.
  void remove(const std::shared_ptr<Binding>& binding);
  void setLink(std::uint32_t index, Binding* binding);
  // Looks for servers whenever a new one may have appeared, while `waiting` bindings do not have
  // theirs.
  void waitForNames(bool wait);

  // The dispatcher's own thread runs it, and no other.
  [[nodiscard]] bool hasThread() const noexcept { return hasThread_; }
  // The callback of a client of that server has thrown what is being handled.
  void noteThrower(const std::string& server, std::int32_t location) noexcept;

 private:
  RunnerGuard acquireLock();
  template <class IsOver>
  bool run(Deadline deadline, const IsOver& isOver);
  bool takeStop() noexcept;
  bool step();
  bool tryStep();
  void dropKnocks() noexcept;
  bool handleNews();
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
  Round dead_;  // of those whose server may have died
  Round waiting_;  // of those whose server may be there
  Round due_;
  Watcher::Token namesToken_ = 0;
  std::atomic<std::int64_t> dueNs_{INT64_MAX};
  std::atomic<bool> stop_{false};
  std::atomic<bool> ended_{false};
  RunnerLock lock_;
  // the thread that waits in run(), or the last one that did
  std::atomic<std::thread::id> waitingThread_;
  CallbackErrors errors_;
  int depth_ = 0;  // of steps, in callbacks of steps
  bool hasDescriptor_ = false;
  bool hasThread_ = false;
  std::thread thread_;
};

}  // namespace mpf
