// SPDX-License-Identifier: MIT
#include "base/stop_signals.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <mutex>
#include <stdexcept>

namespace mpf {
namespace {

struct Slot {
  std::atomic<bool> used{false};
  std::atomic<StopSignals::Callback> callback{nullptr};
  std::atomic<void*> argument{nullptr};
};

// A signal handler reaches nothing but what is static.
std::array<Slot, 64> slots;
std::atomic<unsigned> handling{0};  // threads that are in stop()
std::mutex installMutex;
unsigned users = 0;
std::array<struct sigaction, 2> before;

void stop(int) {
  const int savedErrno = errno;
  // PAIR(stop-handling): either this finds no callback, or who took that away finds this.
  handling.fetch_add(1, std::memory_order_seq_cst);
  for (auto& slot : slots) {
    // PAIR(stop-slot): the argument that was stored before the callback.
    if (const auto callback = slot.callback.load(std::memory_order_seq_cst))
      callback(slot.argument.load(std::memory_order_relaxed));
  }
  // PAIR(stop-handled): after the last use of what the callbacks' owners may destroy then.
  handling.fetch_sub(1, std::memory_order_release);
  errno = savedErrno;
}

// Those threads are not in a child of a fork.
void forgetOthers() noexcept { handling.store(0, std::memory_order_relaxed); }

void install() {
  [[maybe_unused]] static const int once = ::pthread_atfork(nullptr, nullptr, forgetOthers);
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
    throw std::runtime_error("more than 64 wait for signals in one process");
  slots[slot_].argument.store(argument, std::memory_order_relaxed);
  // PAIR(stop-slot): after its argument.
  slots[slot_].callback.store(callback, std::memory_order_release);
  if (users++ == 0) install();
}

StopSignals::~StopSignals() {
  const std::lock_guard lock(installMutex);
  if (--users == 0) uninstall();
  // PAIR(stop-handling): the callback is gone for each handler that is not seen below.
  slots[slot_].callback.store(nullptr, std::memory_order_seq_cst);
  // PAIR(stop-handled): what the handlers did, in other threads, is over.
  while (handling.load(std::memory_order_seq_cst) != 0) ::sched_yield();
  slots[slot_].used.store(false, std::memory_order_relaxed);
}

}  // namespace mpf
