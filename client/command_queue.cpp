// SPDX-License-Identifier: MIT
#include "client/command_queue.h"

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

bool CommandQueue::tryRun(const Command& command) {
  if (lock_.isMine()) {
    command();
    return true;
  }
  if (!lock_.tryAcquireTemporarily()) return false;
  const RunnerGuard guard(&lock_);
  command();
  return true;
}

void CommandQueue::runOrPost(const Command& command) {
  if (!tryRun(command)) postLater(command);
}

// The thread that runs the dispatcher may stop before it has seen the command; then the caller runs
// the command.
void CommandQueue::runOrWait(const Command& command, bool hasOwnThread) {
  if (tryRun(command)) return;
  Waiting waiting{command};
  add(waiting);
  wake_();
  const auto isDone = [&waiting] { return waiting.isDone; };
  for (;;) {
    std::unique_lock lock(mutex_);
    if (hasOwnThread) return waiting.changed.wait(lock, isDone);
    if (waiting.changed.wait_for(lock, kLookForRunner, isDone)) return;
    lock.unlock();
    if (!lock_.tryAcquireTemporarily()) continue;
    const RunnerGuard guard(&lock_);
    if (tryRemove(waiting)) command();
    return;
  }
}

void CommandQueue::add(Waiting& waiting) noexcept {
  const std::lock_guard lock(mutex_);
  waiting.next = std::exchange(waiting_, &waiting);
  hasWaiting_.store(true, std::memory_order_relaxed);
}

// Returns false when another thread has run the command.
bool CommandQueue::tryRemove(Waiting& waiting) noexcept {
  const std::lock_guard lock(mutex_);
  for (auto** place = &waiting_; *place != nullptr; place = &(*place)->next) {
    if (*place != &waiting) continue;
    *place = waiting.next;
    hasWaiting_.store(waiting_ != nullptr, std::memory_order_relaxed);
    return true;
  }
  return false;
}

void CommandQueue::runWaiting() noexcept {
  std::unique_lock lock(mutex_);
  hasWaiting_.store(false, std::memory_order_relaxed);
  for (auto* waiting = std::exchange(waiting_, nullptr); waiting != nullptr;) {
    auto* const next = waiting->next;
    lock.unlock();
    waiting->command();
    lock.lock();
    waiting->isDone = true;
    waiting->changed.notify_one();  // under the lock: then the thread may destroy it
    waiting = next;
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
