// SPDX-License-Identifier: MIT
// CommandQueue: functions that other threads hand to the thread that runs a dispatcher.
//
// Threads  any; run(): the thread that has the RunnerLock.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>

#include <mpf/clock.h>

#include "client/runner_lock.h"

namespace mpf {

class CommandQueue {
 public:
  using Command = std::function<void()>;

  // How often a waiting thread checks whether another thread still runs the dispatcher.
  static constexpr Nanoseconds kLookForRunner = std::chrono::milliseconds(5);

  //   wake   makes the thread that runs the dispatcher call run()
  CommandQueue(RunnerLock& lock, std::function<void()> wake)
      : lock_(lock), wake_(std::move(wake)) {}

  // Runs `command`, which may run callbacks, on the thread that runs the dispatcher: now when that
  // is the calling thread, else in the next step.
  void post(Command command);
  // Runs `command` in the next step, after the callback that is in progress has returned.
  void postLater(Command command);
  // Runs `command`, which runs no callback, now. Returns false, and does not run it, when another
  // thread runs the dispatcher.
  [[nodiscard]] bool tryRun(const Command& command);
  // As tryRun(); when another thread runs the dispatcher, the command runs in the next step.
  void runOrPost(const Command& command);
  // As tryRun(), for a command that throws nothing; when another thread runs the dispatcher, waits
  // until that thread has run the command in runWaiting(). Needs no memory.
  //   hasOwnThread   a thread of the dispatcher runs it without end
  void runOrWait(const Command& command, bool hasOwnThread);

  [[nodiscard]] bool hasCommands() const noexcept {
    return hasCommands_.load(std::memory_order_relaxed);
  }
  // Runs the commands that are posted now. Removes each before it runs: when it throws, the others
  // stay posted.
  void run();
  // Whether a thread waits in runOrWait().
  [[nodiscard]] bool hasWaiting() const noexcept {
    return hasWaiting_.load(std::memory_order_relaxed);
  }
  // Runs the commands of the threads that wait now. To be called while no callback is in progress.
  void runWaiting() noexcept;

 private:
  // A command whose thread waits, on the stack of that thread.
  struct Waiting {
    const Command& command;
    Waiting* next = nullptr;
    bool isDone = false;
    std::condition_variable changed{};
  };
  Command take();
  void add(Waiting& waiting) noexcept;
  bool tryRemove(Waiting& waiting) noexcept;

  RunnerLock& lock_;
  std::function<void()> wake_;
  std::mutex mutex_;
  std::deque<Command> commands_;  // under mutex_
  std::atomic<bool> hasCommands_{false};  // written under mutex_
  Waiting* waiting_ = nullptr;  // a list, which like its members is under mutex_
  std::atomic<bool> hasWaiting_{false};  // written under mutex_
};

}  // namespace mpf
