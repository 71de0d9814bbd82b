// SPDX-License-Identifier: MIT
#include "drivers/serial/port_tasks.h"

#include <sys/eventfd.h>

#include <cstdint>
#include <utility>

#include "base/system_call.h"

namespace mpf {

PortTasks::PortTasks() : bell_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd")) {}

void PortTasks::wake() const noexcept {
  const std::uint64_t one = 1;
  // full: it is awake already
  static_cast<void>(retryInterrupted([&] { return ::write(bell_.get(), &one, sizeof one); }));
}

void PortTasks::callUntil(const bool& done, std::function<void()> begin,
                          const std::function<void()>& whileWaiting) {
  std::unique_lock lock(mutex_);
  waiting_.push_back(std::move(begin));
  wake();
  const auto isDone = [&] { return done; };
  if (!whileWaiting) return finished_.wait(lock, isDone);
  while (!finished_.wait_for(lock, kAskEvery, isDone)) {
    lock.unlock();
    whileWaiting();
    lock.lock();
  }
}

void PortTasks::call(const std::function<void()>& task) {
  bool done = false;
  callUntil(done, [&] {
    task();
    finish(done);
  });
}

void PortTasks::runAll() {
  std::uint64_t rings = 0;
  // nothing to read: not rung
  static_cast<void>(retryInterrupted([&] { return ::read(bell_.get(), &rings, sizeof rings); }));
  std::vector<std::function<void()>> tasks;
  {
    const std::lock_guard lock(mutex_);
    tasks.swap(waiting_);
  }
  for (const auto& task : tasks) task();
}

void PortTasks::finish(bool& done) {
  // notified under the lock: `done` lives in the caller's frame, which may go right after
  const std::lock_guard lock(mutex_);
  done = true;
  finished_.notify_all();
}

}  // namespace mpf
