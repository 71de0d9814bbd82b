// SPDX-License-Identifier: MIT
// PortTasks: passes work to the port's thread and waits until it is done.
//
//   caller         call(task) ── queue ── wake ── wait ──────────────────── done ──► returns
//                                                   └─ callUntil: calls whileWaiting
//   port's thread        poll(descriptor()) ──► runAll(): task ... finish(done) ┘
//
// Threads  any number of callers at a time; one thread runs the tasks. No task blocks, so a task
//          never delays the caller of another one.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <vector>

#include <mpf/file_descriptor.h>

namespace mpf {

class PortTasks {
 public:
  PortTasks();

  // For poll(): readable after call(), callUntil() or wake(), until runAll().
  [[nodiscard]] int descriptor() const noexcept { return bell_.get(); }
  void wake() const noexcept;

  // Runs `begin` on the port's thread and returns when `done` is true, which the port's thread sets
  // with finish(), during `begin` or later.
  //   whileWaiting  called on the caller's thread every kAskEvery during the wait; may use call()
  void callUntil(const bool& done, std::function<void()> begin,
                 const std::function<void()>& whileWaiting = {});
  static constexpr std::chrono::milliseconds kAskEvery{20};
  // Runs `task` on the port's thread and returns when it has run.
  void call(const std::function<void()>& task);

  // --- for the port's thread
  void runAll();
  void finish(bool& done);

 private:
  std::mutex mutex_;
  std::condition_variable finished_;
  std::vector<std::function<void()>> waiting_;  // under mutex_
  FileDescriptor bell_;  // eventfd
};

}  // namespace mpf
