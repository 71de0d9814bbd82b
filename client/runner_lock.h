// SPDX-License-Identifier: MIT
// RunnerLock: at most one thread at a time runs a dispatcher.
//
//   free ── acquire() ───────────────► owned by a runner ─── release() ──► free
//                                      runOnce(), run(), runPending()
//   free ── tryAcquireTemporarily() ─► owned temporarily ─── release() ──► free
//                                      bind(), connectWait(), the end of a client
//
//   when another thread      acquire()                                tryAcquireTemporarily()
//   is the runner            throws: two runners are a program error  returns false
//   is the temporary owner   waits: isRunnerWaiting() makes the       returns false
//                            owner release the lock
//
// Threads  any.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>

#include "base/bias.h"
#include "shm/process_condition.h"

namespace mpf {

class RunnerLock {
 public:
  [[nodiscard]] bool isMine() const noexcept {
    return bias_.isMine() ||
           (owner_.load(std::memory_order_relaxed) & ~kTemporary) == threadNumber();
  }

  // Makes the calling thread the runner, if it has been the only one for a while and is not inside
  // by its bias already. Cheap. A thread that has the lock in another way may enter, too.
  [[nodiscard]] bool tryEnter() noexcept { return !bias_.isInside() && bias_.tryEnter(); }
  // After tryEnter().
  void leave() noexcept { bias_.leave(); }

  // Makes the calling thread, which does not own the lock, the runner.
  //   wakeOwner  makes a temporary owner call isRunnerWaiting()
  //   throws     std::logic_error when another thread is the runner
  template <class WakeOwner>
  void acquire(const WakeOwner& wakeOwner) {
    if (bias_.tryEnter()) return;
    acquireReal(wakeOwner);
  }

  // Throws the std::logic_error of acquire().
  [[noreturn]] static void throwOtherRunner();

  // False when another thread owns the lock or waits in acquire().
  [[nodiscard]] bool tryAcquireTemporarily() noexcept;
  void release() noexcept {
    if (bias_.isMine()) bias_.leave();
    else releaseReal();
  }

  // True when a temporary owner must release the lock.
  [[nodiscard]] bool isRunnerWaiting() const noexcept {
    // PAIR(runner-waiting): a thread that this load does not see calls wakeOwner() after it.
    return waitingRunners_.load(std::memory_order_seq_cst) != 0;
  }

  // True when the last runner is another thread and has not ended: callbacks belong on it.
  [[nodiscard]] bool hasOtherRunner();

 private:
  static constexpr std::uint64_t kTemporary = 1;

  template <class WakeOwner>
  [[gnu::noinline]] void acquireReal(const WakeOwner& wakeOwner) {
    if (!tryTake(threadNumber())) {
      const WaitingRunner waiting(waitingRunners_);
      wakeOwner();
      waitForTemporaryOwner();
    }
    noteRunner();
  }

  class WaitingRunner {
   public:
    explicit WaitingRunner(std::atomic<int>& number) noexcept : number_(number) {
      // PAIR(runner-waiting): before wakeOwner().
      number_.fetch_add(1, std::memory_order_seq_cst);
    }
    ~WaitingRunner() { number_.fetch_sub(1, std::memory_order_relaxed); }
    WaitingRunner(const WaitingRunner&) = delete;
    WaitingRunner& operator=(const WaitingRunner&) = delete;

   private:
    std::atomic<int>& number_;
  };

  bool tryTake(std::uint64_t owner) noexcept {
    std::uint64_t free = 0;
    // PAIR(runner): what the previous owner did.
    return owner_.compare_exchange_strong(free, owner, std::memory_order_acquire,
                                          std::memory_order_relaxed);
  }
  void releaseReal() noexcept;
  void waitForTemporaryOwner();
  void noteRunner();
  void endOtherBias();
  void noteLastRunner();

  // threadNumber() of the owner, plus kTemporary; 0: free, or the runner has the bias
  std::atomic<std::uint64_t> owner_{0};
  Bias bias_;  // of the thread that has been the runner for a while
  std::atomic<int> waitingRunners_{0};  // threads that wait in acquire()
  std::atomic<std::uint64_t> lastRunner_{0};  // its threadNumber(); written under mutex_
  std::mutex mutex_;
  ProcessCondition released_;  // by a temporary owner
  std::weak_ptr<void> lastRunnerAlive_;  // under mutex_; expires when that thread ends
};

// Releases a lock at the end of the scope.
class RunnerGuard {
 public:
  //   lock   nullptr: nothing is released
  explicit RunnerGuard(RunnerLock* lock) noexcept : RunnerGuard(lock, false) {}
  // After lock.tryEnter(), which costs less to undo than other ways to take the lock.
  [[nodiscard]] static RunnerGuard entered(RunnerLock& lock) noexcept { return {&lock, true}; }
  [[gnu::always_inline]] ~RunnerGuard() {
    if (hasEntered_) lock_->leave();
    else if (lock_ != nullptr) lock_->release();
  }
  RunnerGuard(const RunnerGuard&) = delete;
  RunnerGuard& operator=(const RunnerGuard&) = delete;

 private:
  RunnerGuard(RunnerLock* lock, bool hasEntered) noexcept : lock_(lock), hasEntered_(hasEntered) {}

  RunnerLock* lock_;
  bool hasEntered_;
};

}  // namespace mpf
