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
  // fails only when the counter of the eventfd is full, and then it is readable already
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
  // the read fails when the eventfd was not written, which is not an error
  static_cast<void>(retryInterrupted([&] { return ::read(bell_.get(), &rings, sizeof rings); }));
  std::vector<std::function<void()>> tasks;
  {
    const std::lock_guard lock(mutex_);
    tasks.swap(waiting_);
  }
  for (const auto& task : tasks) task();
}

void PortTasks::finish(bool& done) {
  // `done` is in the stack frame of the caller, which may return as soon as the lock is released.
  const std::lock_guard lock(mutex_);
  done = true;
  finished_.notify_all();
}

}  // namespace mpf
