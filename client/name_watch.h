// SPDX-License-Identifier: MIT
// NameWatch: tells a dispatcher that a server has appeared. It runs only while a binding waits for
// its server.
//
// Threads  noteChange(): any. The rest: the dispatcher's thread.
#pragma once

#include <atomic>

#include "shm/endpoint.h"

namespace mpf {

class NameWatch {
 public:
  explicit NameWatch(Endpoint& endpoint) noexcept : endpoint_(endpoint) {}
  ~NameWatch();
  NameWatch(const NameWatch&) = delete;
  NameWatch& operator=(const NameWatch&) = delete;

  // Does nothing when the watch runs. Otherwise counts as a change, for a server that appeared
  // before.
  void start();
  void stop();
  [[nodiscard]] bool isRunning() const noexcept { return token_ != 0; }

  // Wakes the dispatcher, which then takes the change.
  void noteChange() noexcept;
  [[nodiscard]] bool takeChange() noexcept {
    return hasChanged_.exchange(false, std::memory_order_relaxed);
  }

 private:
  Endpoint& endpoint_;
  Watcher::Token token_ = 0;
  std::atomic<bool> hasChanged_{false};
};

}  // namespace mpf
