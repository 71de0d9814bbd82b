// SPDX-License-Identifier: MIT
#include "client/runner_lock.h"

#include <stdexcept>

namespace mpf {
namespace {

// Lives as long as the calling thread.
const std::shared_ptr<void>& lifeOfThread() {
  thread_local const std::shared_ptr<void> life = std::make_shared<char>();
  return life;
}

}  // namespace

bool RunnerLock::tryEnterAsGuest() noexcept {
  return !isWanted() && tryTake(thisThread() | kGuest);
}

void RunnerLock::leave() noexcept {
  if ((owner_.load(std::memory_order_relaxed) & kGuest) == 0) {
    // PAIR(runner): before another thread takes the lock.
    owner_.store(0, std::memory_order_release);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    // PAIR(runner): as above.
    owner_.store(0, std::memory_order_release);
  }
  left_.notify_all();
}

bool RunnerLock::mayRunAsGuest() {
  const std::lock_guard lock(mutex_);
  return lastRunner_.load(std::memory_order_relaxed) == thisThread() ||
         lastRunnerIsAlive_.expired();
}

void RunnerLock::refuse() {
  throw std::logic_error(
      "Dispatcher: another thread runs this dispatcher. Let one thread run it (a shared dispatcher "
      "has a "
      "thread of its own); bind(), send() and cancel() work from every thread.");
}

void RunnerLock::waitForGuest() {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (tryTake(thisThread())) return;
    const auto owner = owner_.load(std::memory_order_relaxed);
    if (owner != 0 && (owner & kGuest) == 0) refuse();
    if (owner != 0) left_.wait(lock);
  }
}

void RunnerLock::noteLastRunner() try {
  const auto& life = lifeOfThread();
  const std::lock_guard lock(mutex_);
  lastRunnerIsAlive_ = life;
  lastRunner_.store(thisThread(), std::memory_order_relaxed);
} catch (...) {  // std::bad_alloc
  leave();
  throw;
}

}  // namespace mpf
