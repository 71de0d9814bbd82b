// SPDX-License-Identifier: MIT
// Dispatcher::Impl: runs the clients of a process: waits for events and handles them in steps.
//
// Threads  the thread that holds the RunnerLock, unless a comment says that any thread may call.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include <mpf/dispatcher.h>

#include "client/binding_rounds.h"
#include "client/dispatcher_parts.h"

namespace mpf {

class Dispatcher::Impl {
 public:
  Impl(Backplane backplane, const DispatcherOptions& options);
  ~Impl();

  // The thread keeps `self` alive.
  void startThread(const std::shared_ptr<Impl>& self);
  void endThread();

  // --- any thread, as long as no other thread runs the dispatcher ---
  // Makes the calling thread the runner until the guard ends. A thread that is already the runner
  // remains the runner.
  //   throws  std::logic_error when another thread runs the dispatcher
  [[nodiscard, gnu::always_inline]] RunnerGuard becomeRunner() {
    endpoint().forkGuard().check("Dispatcher");
    if (parts_.lock.tryEnter()) return RunnerGuard::entered(parts_.lock);
    if (parts_.lock.isMine()) return RunnerGuard(nullptr);
    if (hasThread_) RunnerLock::throwOtherRunner();
    return acquireLock();
  }
  bool runOnce(Deadline deadline);
  bool runPending(int most);
  // As RelayDispatcher::runSome().
  bool runSome(int most);
  int descriptor();
  // Runs until `isDone` or the deadline, or until another thread wants to run the dispatcher.
  // Returns false, and runs nothing, when callbacks belong on another thread.
  [[nodiscard]] bool tryRunUntil(Deadline deadline, const std::function<bool()>& isDone);

  // --- any thread ---
  void interrupt() noexcept;
  [[nodiscard]] Deadline nextDue() const noexcept { return parts_.timer.due(); }
  // Ends a client: none of its callbacks runs afterwards. Waits until the callback in progress has
  // returned, unless it runs on the calling thread.
  void remove(Binding& binding);
  [[nodiscard]] CommandQueue& commands() noexcept { return parts_.commands; }
  // True for a shared dispatcher: only its own thread runs it.
  [[nodiscard]] bool hasThread() const noexcept { return hasThread_; }

  [[nodiscard]] DispatcherParts& parts() noexcept { return parts_; }
  [[nodiscard]] Endpoint& endpoint() noexcept { return parts_.endpoint; }
  [[nodiscard]] BindingRounds& bindings() noexcept { return bindings_; }

 private:
  void runThread();
  RunnerGuard acquireLock() {
    parts_.lock.acquire([this] { endpoint().interrupt(); });
    return RunnerGuard(&parts_.lock);
  }
  template <class IsOver>
  bool run(Deadline deadline, const IsOver& isOver);
  [[nodiscard]] bool takeStop() noexcept {
    return stop_.load(std::memory_order_relaxed) != 0 && takeStopOf(depth_);
  }
  bool takeStopOf(std::uint32_t depth) noexcept;
  bool step();
  bool tryStep();
  bool tryOthers();
  bool takeFrom(Link* link);
  void dropKnocks() noexcept;
  bool handleLocalHints();
  void handlePostponed() noexcept;

  DispatcherParts parts_;
  BindingRounds bindings_{parts_};
  // kAll: interrupt() was called. Otherwise, calls in less than so many nested steps must return.
  std::atomic<std::uint32_t> stop_{0};
  static constexpr std::uint32_t kAll = UINT32_MAX;
  std::atomic<bool> ended_{false};
  std::uint32_t depth_ = 0;  // of nested steps: a callback may run the dispatcher
  bool hasPostponed_ = false;  // there is work for handlePostponed()
  bool hasDescriptor_ = false;
  bool hasThread_ = false;
  bool endsAfterCallback_ = false;  // its thread, in which the last client was destroyed
  std::thread thread_;
};

}  // namespace mpf
