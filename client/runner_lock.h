// SPDX-License-Identifier: MIT
// RunnerLock: at most one thread at a time runs a dispatcher.
//
//   free ── enter() ───────────► runOnce(), run(), runPending() ──────────── leave() ──► free
//   free ── tryEnterAsGuest() ─► bind(), connectWait(), ~MessageClient() ─── leave() ──► free
//
// A guest leaves as soon as another thread waits in enter(). Two threads that both want to enter()
// are an error of the program, and the second one gets an exception.
//
// Threads  any.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>

namespace mpf {

class RunnerLock {
 public:
  [[nodiscard]] bool isMine() const noexcept {
    return (owner_.load(std::memory_order_relaxed) & ~kGuest) == thisThread();
  }

  // The calling thread, which does not have the lock, gets it and is the dispatcher's last runner.
  //   wakeGuest  makes a guest call isWanted()
  //   throws     std::logic_error when another thread that is no guest has the lock
  template <class WakeGuest>
  void enter(const WakeGuest& wakeGuest) {
    if (!tryTake(thisThread())) {
      const Waiter waiter(waiters_);
      wakeGuest();
      waitForGuest();
    }
    if (lastRunner_.load(std::memory_order_relaxed) != thisThread()) noteLastRunner();
  }

  [[noreturn]] static void refuse();

  // False when another thread has the lock or waits for it.
  [[nodiscard]] bool tryEnterAsGuest() noexcept;
  void leave() noexcept;

  // Whether a guest should leave.
  [[nodiscard]] bool isWanted() const noexcept { return waiters_.load() != 0; }

  // Whether no other living thread has called enter() later than the calling one.
  [[nodiscard]] bool mayRunAsGuest();

 private:
  static constexpr std::uintptr_t kGuest = 1;

  struct Waiter {
    explicit Waiter(std::atomic<int>& number) noexcept : waiters(number) { ++waiters; }
    ~Waiter() { --waiters; }
    Waiter(const Waiter&) = delete;
    Waiter& operator=(const Waiter&) = delete;
    std::atomic<int>& waiters;
  };

  // Differs between the threads that live at the same time; even.
  static std::uintptr_t thisThread() noexcept {
    static thread_local const std::uint16_t mark = 0;
    return reinterpret_cast<std::uintptr_t>(&mark);
  }
  bool tryTake(std::uintptr_t owner) noexcept {
    std::uintptr_t nobody = 0;
    // PAIR(runner): what the thread that had the lock before did.
    return owner_.compare_exchange_strong(nobody, owner, std::memory_order_acquire,
                                          std::memory_order_relaxed);
  }
  void waitForGuest();
  void noteLastRunner();

  std::atomic<std::uintptr_t> owner_{0};  // thisThread() of the owner, with kGuest for a guest
  std::atomic<int> waiters_{0};  // threads that wait in enter()
  std::atomic<std::uintptr_t> lastRunner_{0};  // written under mutex_
  std::mutex mutex_;
  std::condition_variable left_;  // a guest has left
  std::weak_ptr<void> lastRunnerIsAlive_;  // under mutex_; expires with the thread
};

// Leaves the lock, if there is one, at the end of its life.
class RunnerTurn {
 public:
  explicit RunnerTurn(RunnerLock* lock) noexcept : lock_(lock) {}
  ~RunnerTurn() {
    if (lock_ != nullptr) lock_->leave();
  }
  RunnerTurn(const RunnerTurn&) = delete;
  RunnerTurn& operator=(const RunnerTurn&) = delete;

 private:
  RunnerLock* lock_;
};

}  // namespace mpf
