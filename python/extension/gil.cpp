// SPDX-License-Identifier: MIT
#include "python/extension/gil.h"

#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <thread>

#include <mpf/clock.h>

namespace mpf::python {
namespace {

constexpr std::chrono::microseconds kLookEvery{100};
// Functions of a program that numpy calls may wait; the exit does not wait for them longer.
constexpr std::chrono::seconds kLongestCall{1};
constexpr std::size_t kManyBytes = 65536;

std::atomic<bool> isExiting = false;
std::atomic<int> entering = 0;  // threads that ask for the GIL, or may ask for it
pthread_t exitingThread;  // valid when isExiting is true

// Adds this thread to `entering`. Returns false when it must not ask for the GIL any more.
bool tryEnter() {
  // PAIR(python-exit): either prepareExit() sees this thread in `entering`, or it sees isExiting.
  entering.fetch_add(1);
  if (!isExiting.load() || pthread_equal(pthread_self(), exitingThread) != 0) return true;
  entering.fetch_sub(1);
  return false;
}

[[noreturn]] void stop() {
  for (;;) ::pause();
}

void resume(PyThreadState* state) {
  if (!tryEnter()) stop();
  PyEval_RestoreThread(state);
  entering.fetch_sub(1);
}

}  // namespace

WithoutGil::WithoutGil() : state_(PyEval_SaveThread()) {}

WithoutGil::~WithoutGil() { resume(state_); }

std::function<bool()> WithoutGil::interruption() {
  return [this] {
    resume(state_);
    wasInterrupted_ = PyErr_CheckSignals() != 0;
    state_ = PyEval_SaveThread();
    return wasInterrupted_;
  };
}

CallsPython::CallsPython() {
  if (tryEnter()) return;
  PyEval_SaveThread();
  stop();
}

CallsPython::~CallsPython() { entering.fetch_sub(1); }

void copyBytes(std::byte* to, std::span<const std::byte> from) {
  if (from.empty()) return;
  if (from.size() < kManyBytes) {
    std::memcpy(to, from.data(), from.size());
    return;
  }
  const WithoutGil unlocked;
  std::memcpy(to, from.data(), from.size());
}

void forgetThreadsInForks() {
  ::pthread_atfork(nullptr, nullptr, [] { entering.store(0); });
}

void prepareExit() {
  exitingThread = pthread_self();
  auto* state = PyEval_SaveThread();
  // PAIR(python-exit): no thread enters after this store.
  isExiting.store(true);
  const auto patience = Deadline::after(kLongestCall);
  while (entering.load() > 0 && !patience.hasPassed()) std::this_thread::sleep_for(kLookEvery);
  PyEval_RestoreThread(state);
}

}  // namespace mpf::python
