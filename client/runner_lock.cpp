// SPDX-License-Identifier: MIT
#include "client/runner_lock.h"

#include <stdexcept>

namespace mpf {
namespace {

// An object that is destroyed when the calling thread ends.
const std::shared_ptr<void>& lifeOfThread() {
  thread_local const std::shared_ptr<void> life = std::make_shared<char>();
  return life;
}

}  // namespace

bool RunnerLock::tryAcquireTemporarily() noexcept {
  if (isRunnerWaiting() || !tryTake(threadNumber() | kTemporary)) return false;
  if (bias_.disable()) return true;
  release();
  return false;
}

void RunnerLock::noteRunner() {
  // A bias that an earlier attempt has disabled ends only when its owner leaves.
  if (bias_.isOfAnotherThread() || bias_.isInside()) endOtherBias();
  bias_.noteEntry();
  if (lastRunner_.load(std::memory_order_relaxed) != threadNumber()) noteLastRunner();
}

// The owner of the bias may be the runner. Until that is known, the calling thread is a temporary
// owner, so that a runner that has lost the bias waits and does not throw.
void RunnerLock::endOtherBias() {
  owner_.store(threadNumber() | kTemporary, std::memory_order_relaxed);
  if (!bias_.disable()) {
    release();
    throwOtherRunner();
  }
  {
    const std::lock_guard lock(mutex_);
    owner_.store(threadNumber(), std::memory_order_relaxed);
  }
  released_.get().notify_all();
}

void RunnerLock::releaseReal() noexcept {
  if ((owner_.load(std::memory_order_relaxed) & kTemporary) == 0) {
    // PAIR(runner): before another thread takes the lock.
    owner_.store(0, std::memory_order_release);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    // PAIR(runner): as above.
    owner_.store(0, std::memory_order_release);
  }
  released_.get().notify_all();
}

bool RunnerLock::hasOtherRunner() {
  const std::lock_guard lock(mutex_);
  return lastRunner_.load(std::memory_order_relaxed) != threadNumber() &&
         !lastRunnerAlive_.expired();
}

void RunnerLock::throwOtherRunner() {
  throw std::logic_error(
      "Dispatcher: another thread runs this dispatcher. Let one thread run it (a shared dispatcher "
      "has a thread of its own); bind(), send() and cancel() work from every thread.");
}

void RunnerLock::waitForTemporaryOwner() {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (tryTake(threadNumber())) return;
    const auto owner = owner_.load(std::memory_order_relaxed);
    if (owner != 0 && (owner & kTemporary) == 0) throwOtherRunner();
    if (owner != 0) released_.get().wait(lock);
  }
}

void RunnerLock::noteLastRunner() try {
  const auto& life = lifeOfThread();
  const std::lock_guard lock(mutex_);
  lastRunnerAlive_ = life;
  lastRunner_.store(threadNumber(), std::memory_order_relaxed);
} catch (...) {  // std::bad_alloc
  release();
  throw;
}

}  // namespace mpf
