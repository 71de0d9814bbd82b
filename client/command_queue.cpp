// SPDX-License-Identifier: MIT
#include "client/command_queue.h"

#include <condition_variable>
#include <memory>
#include <utility>

namespace mpf {

void CommandQueue::post(Command command) {
  if (lock_.isMine()) return command();
  postLater(std::move(command));
}

void CommandQueue::postLater(Command command) {
  {
    const std::lock_guard lock(mutex_);
    commands_.push_back(std::move(command));
    hasCommands_.store(true, std::memory_order_relaxed);
  }
  wake_();
}

void CommandQueue::runOrPost(const Command& command) {
  if (lock_.isMine()) return command();
  if (!lock_.tryAcquireTemporarily()) return postLater(command);
  const RunnerGuard guard(&lock_);
  command();
}

// The thread that runs the dispatcher may stop before it has seen the command; then the caller runs
// the command.
void CommandQueue::runOrPostAndWait(const Command& command, bool hasOwnThread) {
  if (lock_.isMine()) return command();
  struct State {
    bool isStarted = false;  // under lock_
    bool isDone = false;  // under mutex
    std::mutex mutex;
    std::condition_variable changed;
  };
  const auto state = std::make_shared<State>();
  const auto runFirst = [state, &command] {
    if (std::exchange(state->isStarted, true)) return;
    command();
    const std::lock_guard lock(state->mutex);
    state->isDone = true;
    state->changed.notify_one();
  };
  const auto isDone = [&] { return state->isDone; };
  for (bool isPosted = false;; isPosted = true) {
    if (lock_.tryAcquireTemporarily()) {
      const RunnerGuard guard(&lock_);
      return runFirst();
    }
    if (!isPosted) postLater(runFirst);
    std::unique_lock lock(state->mutex);
    if (hasOwnThread) return state->changed.wait(lock, isDone);
    if (state->changed.wait_for(lock, kLookForRunner, isDone)) return;
  }
}

void CommandQueue::run() {
  std::size_t left = 0;
  {
    const std::lock_guard lock(mutex_);
    left = commands_.size();
  }
  for (; left != 0; --left) {
    const auto command = take();
    if (!command) return;  // a callback ran the dispatcher
    command();
  }
}

CommandQueue::Command CommandQueue::take() {
  const std::lock_guard lock(mutex_);
  if (commands_.empty()) return {};
  auto command = std::move(commands_.front());
  commands_.pop_front();
  hasCommands_.store(!commands_.empty(), std::memory_order_relaxed);
  return command;
}

}  // namespace mpf
