// SPDX-License-Identifier: MIT
// PortTasks: hands work to a port's thread and waits for it.
//
//   caller         call(task) ── queue ── wake ── wait ──────────────────── done ──► goes on
//                                                   └─ callUntil: asks now and then
//   port's thread        poll(descriptor()) ──► runAll(): task ... finish(done) ┘
//
// Threads  any may call; one runs the tasks and never blocks in one, so a caller waits as long as
//          its task says.
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

  // Readable when there is something to run, or when woken.
  [[nodiscard]] int descriptor() const noexcept { return bell_.get(); }
  void wake() const noexcept;

  // Runs `begin` on the port's thread and returns once `done`, which the port's thread sets by
  // finish().
  //   whileWaiting  runs on the caller's thread every kAskEvery as long as the wait lasts; it may
  //                 call()
  void callUntil(const bool& done, std::function<void()> begin,
                 const std::function<void()>& whileWaiting = {});
  static constexpr std::chrono::milliseconds kAskEvery{20};
  void call(const std::function<void()>& task);

  // For the port's thread.
  void runAll();
  void finish(bool& done);

 private:
  std::mutex mutex_;
  std::condition_variable finished_;
  std::vector<std::function<void()>> waiting_;  // under mutex_
  FileDescriptor bell_;  // eventfd
};

}  // namespace mpf
