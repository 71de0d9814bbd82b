// SPDX-License-Identifier: MIT
#include <mpf/classic/vxworks.h>

#include <pthread.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>

#include <mpf/clock.h>

#include "base/print_error.h"

namespace {

constexpr int kTicksPerSecond = 60;
constexpr std::size_t kMaxThreadName = 15;
using Ticks = std::chrono::duration<int, std::ratio<1, kTicksPerSecond>>;

}  // namespace

int mpf::classic::spawnTask(const char* name, FUNCPTR entry, const Word (&words)[10]) {
  // The linkage of C passes arguments that the entry does not declare, and ignores them.
  using Entry = void (*)(Word, Word, Word, Word, Word, Word, Word, Word, Word, Word);
  const auto run = reinterpret_cast<Entry>(reinterpret_cast<void (*)()>(entry));
  static std::atomic<int> tasks{0};
  const auto number = tasks.fetch_add(1, std::memory_order_relaxed) + 1;
  // As in VxWorks, a task without a name is t1, t2, ...
  const auto title = name != nullptr ? std::string(name) : "t" + std::to_string(number);
  try {
    std::thread([run, title, w = std::to_array(words)] {
      ::pthread_setname_np(::pthread_self(), title.substr(0, kMaxThreadName).c_str());
      run(w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7], w[8], w[9]);
    }).detach();
  } catch (const std::system_error& error) {
    mpf::printError("taskSpawn: cannot start task {}: {}\n", title, error.what());
    return ERROR;
  }
  return number;
}

STATUS taskDelay(int ticks) {
  std::this_thread::sleep_for(Ticks(ticks));
  return OK;
}

int sysClkRateGet() { return kTicksPerSecond; }

unsigned long tickGet() {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return static_cast<unsigned long>(mpf::Clock::nowNs() / (kNsPerSecond / kTicksPerSecond));
}

struct MpfClassicSemaphore {
  bool isMutex = false;
  std::mutex mutex;
  std::condition_variable given;
  bool isFull = true;  // these three under mutex
  std::thread::id owner;
  int depth = 0;  // how often the owner has taken it

  // With the mutex locked.
  bool tryTake() {
    if (isMutex && depth > 0 && owner == std::this_thread::get_id()) {
      ++depth;
      return true;
    }
    if (!isFull) return false;
    isFull = false;
    owner = std::this_thread::get_id();
    depth = 1;
    return true;
  }
};

SEM_ID semBCreate(int /*options*/, SEM_B_STATE initialState) {
  auto semaphore = std::make_unique<MpfClassicSemaphore>();
  semaphore->isFull = initialState == SEM_FULL;
  return semaphore.release();
}

SEM_ID semMCreate(int /*options*/) {
  auto semaphore = std::make_unique<MpfClassicSemaphore>();
  semaphore->isMutex = true;
  return semaphore.release();
}

STATUS semTake(SEM_ID semaphore, int timeout) {
  std::unique_lock lock(semaphore->mutex);
  const auto take = [semaphore] { return semaphore->tryTake(); };
  if (timeout != WAIT_FOREVER)
    return semaphore->given.wait_for(lock, Ticks(timeout), take) ? OK : ERROR;
  semaphore->given.wait(lock, take);
  return OK;
}

STATUS semGive(SEM_ID semaphore) {
  const std::lock_guard lock(semaphore->mutex);
  if (semaphore->isMutex) {
    if (semaphore->depth == 0 || semaphore->owner != std::this_thread::get_id()) return ERROR;
    if (--semaphore->depth > 0) return OK;
  }
  semaphore->isFull = true;
  semaphore->given.notify_one();
  return OK;
}

STATUS semDelete(SEM_ID semaphore) {
  delete semaphore;
  return OK;
}
