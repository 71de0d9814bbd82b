// SPDX-License-Identifier: MIT
// CommandQueue: functions that other threads hand to the thread that runs a dispatcher.
//
// Threads  any; run(): the thread that has the RunnerLock.
#pragma once

#include <atomic>
#include <chrono>
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
  // Runs `command`, which runs no callback: now when no other thread runs the dispatcher, else in
  // the next step.
  void runOrPost(const Command& command);
  // As runOrPost(), and waits until the command has run.
  //   hasOwnThread   a thread of the dispatcher runs it without end
  void runOrPostAndWait(const Command& command, bool hasOwnThread);

  [[nodiscard]] bool hasCommands() const noexcept {
    return hasCommands_.load(std::memory_order_relaxed);
  }
  // Runs the commands that are posted now. Removes each before it runs: when it throws, the others
  // stay posted.
  void run();

 private:
  Command take();

  RunnerLock& lock_;
  std::function<void()> wake_;
  std::mutex mutex_;
  std::deque<Command> commands_;  // under mutex_
  std::atomic<bool> hasCommands_{false};  // written under mutex_
};

}  // namespace mpf
