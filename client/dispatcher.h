// SPDX-License-Identifier: MIT
// Dispatcher: runs the callbacks of clients. One client window; any number of clients.
//
//   Dispatcher::shared(backplane)   a thread of its own, one per process and backplane: what most programs use
//   Dispatcher(backplane)           no thread: run it where callbacks shall run, in a loop of its own or in an event loop
//
// Threads  run*() by one thread at a time. With a thread of its own, nothing else to know.
// Crash    see MessageClient.
// Trust    see MessageClient.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <mpf/base/clock.h>
#include <mpf/shm/backplane.h>

namespace mpf {

struct DispatcherOptions {
  WaitMode waitMode = WaitMode::adaptive;
  std::string label;  // shown by `mpf ls`; empty: the program's name
};

class Dispatcher {
 public:
  explicit Dispatcher(const Backplane& backplane, const DispatcherOptions& options = {});
  ~Dispatcher();
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  // The backplane's dispatcher with a thread of its own; it ends with its last client.
  static std::shared_ptr<Dispatcher> shared(const Backplane& backplane);

  // Runs what is due, or waits for it. False: the deadline passed first, or interrupt() was called.
  bool runOnce(Deadline deadline = Deadline::never());
  // Runs until interrupt().
  void run();
  // Ends run() or runOnce(), now or the next time. Async-signal-safe.
  void interrupt() noexcept;

  // For event loops: poll() the descriptor for reading, at most until nextDeadline(), then runPending(), which arms it again.
  [[nodiscard]] int descriptor();
  // At most `batches` of messages. False: there may be more, and the descriptor stays readable.
  bool runPending(int batches = kPendingBatches);
  static constexpr int kPendingBatches = 1024;
  [[nodiscard]] Deadline nextDeadline() const noexcept;

  [[nodiscard]] const Backplane& backplane() const noexcept;

 private:
  friend class MessageClient;
  friend class Binding;
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace mpf
