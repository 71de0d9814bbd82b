// SPDX-License-Identifier: MIT
#include "base/stop_signals.h"

#include <pthread.h>
#include <signal.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <stdexcept>
#include <thread>

namespace mpf {
namespace {

struct Slot {
  std::atomic<bool> used{false};
  std::atomic<StopSignals::Callback> callback{nullptr};
  std::atomic<void*> argument{nullptr};
};

// Static, because a signal handler cannot reach other objects.
std::array<Slot, 64> slots;
std::atomic<unsigned> handling{0};  // number of threads that execute stop()
std::mutex installMutex;
unsigned users = 0;
std::array<struct sigaction, 2> before;

void stop(int) {
  const int savedErrno = errno;
  // PAIR(stop-handling): either this handler finds no callback, or the destructor that removes the
  // callback sees that a handler is running.
  handling.fetch_add(1, std::memory_order_seq_cst);
  for (auto& slot : slots) {
    // PAIR(stop-slot): also sees the argument, which was stored before the callback.
    if (const auto callback = slot.callback.load(std::memory_order_seq_cst))
      callback(slot.argument.load(std::memory_order_relaxed));
  }
  // PAIR(stop-handled): after the last use of the arguments, which their owners may then destroy.
  handling.fetch_sub(1, std::memory_order_release);
  errno = savedErrno;
}

// A fork waits until no thread holds the mutex: the child could never lock it again. The child does
// not have the parent's other threads, so none of them executes stop().
void lock() noexcept { installMutex.lock(); }
void unlock() noexcept { installMutex.unlock(); }
void unlockAlone() noexcept {
  handling.store(0, std::memory_order_relaxed);
  installMutex.unlock();
}
[[maybe_unused]] const int kForkHandlers = ::pthread_atfork(lock, unlock, unlockAlone);

void install() {
  struct sigaction action{};
  action.sa_handler = stop;
  ::sigemptyset(&action.sa_mask);
  ::sigaction(SIGINT, &action, &before[0]);
  ::sigaction(SIGTERM, &action, &before[1]);
}

void uninstall() {
  ::sigaction(SIGINT, &before[0], nullptr);
  ::sigaction(SIGTERM, &before[1], nullptr);
}

}  // namespace

StopSignals::StopSignals(Callback callback, void* argument) : slot_(0) {
  const std::lock_guard lock(installMutex);
  while (slot_ < slots.size() && slots[slot_].used.exchange(true, std::memory_order_relaxed))
    ++slot_;
  if (slot_ == slots.size())
    throw std::runtime_error(
        "StopSignals: this process already has 64; destroy one before creating another");
  slots[slot_].argument.store(argument, std::memory_order_relaxed);
  // PAIR(stop-slot): the argument is stored before the callback.
  slots[slot_].callback.store(callback, std::memory_order_release);
  if (users++ == 0) install();
}

StopSignals::~StopSignals() {
  const std::lock_guard lock(installMutex);
  if (--users == 0) uninstall();
  // PAIR(stop-handling): a handler that the loop below does not see finds no callback.
  slots[slot_].callback.store(nullptr, std::memory_order_seq_cst);
  // PAIR(stop-handled): the handlers in other threads have finished.
  while (handling.load(std::memory_order_seq_cst) != 0)
    std::this_thread::sleep_for(std::chrono::microseconds(20));
  slots[slot_].used.store(false, std::memory_order_relaxed);
}

}  // namespace mpf
