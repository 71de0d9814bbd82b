// SPDX-License-Identifier: MIT
#include "client/last_callbacks.h"

#include <condition_variable>
#include <cstdlib>
#include <mutex>

#include "shm/per_process.h"

namespace mpf::last_callbacks {
namespace {

struct State {
  std::mutex mutex;
  std::condition_variable changed;
  int threads = 0;  // under mutex
};

thread_local bool isInside = false;

// Never destroyed: the threads use it while the process exits. In the child of a fork, which has
// none of these threads, it is a new one.
State& state() {
  static auto& ofProcess = *new PerProcess<State>;
  return ofProcess.get();
}

// A callback may call exit(), too.
void waitForOthers() {
  auto& all = state();
  std::unique_lock lock(all.mutex);
  all.changed.wait(lock, [&] { return all.threads == (isInside ? 1 : 0); });
}

}  // namespace

void prepare() {
  state();
  [[maybe_unused]] static const int kRegistered = std::atexit(waitForOthers);
}

void begin() noexcept {
  auto& all = state();
  const std::lock_guard lock(all.mutex);
  ++all.threads;
  isInside = true;
}

void end() noexcept {
  auto& all = state();
  const std::lock_guard lock(all.mutex);
  --all.threads;
  isInside = false;
  all.changed.notify_all();
}

}  // namespace mpf::last_callbacks
