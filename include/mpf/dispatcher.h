// SPDX-License-Identifier: MIT
// Dispatcher: runs the callbacks of clients. One client window; any number of clients.
//
//   Dispatcher::shared(backplane)   a thread of its own, one per process and backplane: what most
//   programs use Dispatcher(backplane)           no thread: run it where callbacks shall run, in a
//   loop of its own or in an event loop
//
// Threads  run*() by one thread at a time: a second one gets std::logic_error. interrupt(),
//          nextDeadline() and the clients' functions: any thread. Callbacks run on the thread that
//          runs the dispatcher.
// Throws   an exception that leaves a callback leaves the call that runs it: runOnce(), run(),
//          runPending() or connectWait(). The message of that callback has been delivered;
//          everything else is intact, and the next call continues with what is left. On the shared
//          dispatcher's thread there is no such call: it writes what() to stderr (32 lines at once,
//          then one each 10 s), counts the exception as an alarm of its window, and continues.
//          Servers follow the same rule: see MessageServer.
// Crash    see MessageClient.
// Trust    see MessageClient.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <mpf/backplane.h>
#include <mpf/clock.h>
#include <mpf/wait_mode.h>

namespace mpf {

struct DispatcherOptions {
  WaitMode waitMode = WaitMode::adaptive;
  std::string label;  // shown by `mpf ls`; empty: the program's name
};

class Dispatcher {
 public:
  // Creates the client window in shared memory.
  //   throws  std::system_error: ENOSPC when /dev/shm is full, EMFILE when no descriptor is left,
  //           ...
  explicit Dispatcher(const Backplane& backplane, const DispatcherOptions& options = {});
  ~Dispatcher();
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  // The backplane's dispatcher with a thread of its own; it ends with its last client.
  //   throws  as the constructor; std::system_error with EAGAIN when no thread can be started
  static std::shared_ptr<Dispatcher> shared(const Backplane& backplane);

  // Runs what is due, or waits for it. False: the deadline passed first, or interrupt() was called.
  //   throws  what a callback throws; std::logic_error when another thread runs the dispatcher
  bool runOnce(Deadline deadline = Deadline::never());
  // Runs until interrupt(). Throws as runOnce().
  void run();
  // Ends run() or runOnce(), now or the next time. Async-signal-safe.
  void interrupt() noexcept;

  // For event loops: poll() the descriptor for reading, at most until nextDeadline(), then
  // runPending(), which arms it again.
  [[nodiscard]] int descriptor();
  // At most `batches` of messages. False: there may be more, and the descriptor stays readable.
  // Throws as runOnce(); then, too, the descriptor stays readable.
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
