// SPDX-License-Identifier: MIT
// Dispatcher: runs the callbacks of clients. It has one client window in shared memory and any
// number of clients.
//
//   Dispatcher::shared(backplane)   has a thread; one per process and backplane; the usual case
//   Dispatcher(backplane)           has no thread: the program runs it on the thread that is to run
//                                   the callbacks, in a loop or in an event loop
//
//   mpf::Dispatcher dispatcher(backplane);
//   mpf::MessageClient client(dispatcher, callback);
//   client.bind("dac");
//   dispatcher.run();
//
// Threads  one thread at a time calls runOnce(), run(), runPending() and descriptor(): a second
//          thread gets std::logic_error. Any thread may call interrupt(), nextDeadline() and the
//          functions of clients. Callbacks run on the thread that runs the dispatcher.
// Throws   an exception that leaves a callback leaves the call that runs it: runOnce(), run(),
//          runPending() or connectWait(). The message of that callback counts as delivered, nothing
//          else is lost, and the next call continues with the remaining messages. The thread of the
//          shared dispatcher has no such caller: it writes what() to stderr (32 lines at once, then
//          one each 10 s), counts the exception as an alarm of its window, and continues. Servers
//          follow the same rule: see MessageServer.
// Crash    as MessageClient.
// Trust    as MessageClient.
// Source   manual, "Message Client": callbacks; the dispatcher replaces their task.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <mpf/backplane.h>
#include <mpf/clock.h>
#include <mpf/wait_mode.h>

namespace mpf {

struct DispatcherOptions {
  WaitMode waitMode = WaitMode::adaptive;  // how a thread waits for messages
  std::string label;  // shown by `mpf ls`; empty: the name of the program
};

class Dispatcher {
 public:
  // Creates the client window in shared memory.
  //   throws  std::system_error, for example ENOSPC when /dev/shm is full, EMFILE when the process
  //           has no file descriptor left
  explicit Dispatcher(const Backplane& backplane, const DispatcherOptions& options = {});
  // The clients of a dispatcher must be destroyed before it.
  ~Dispatcher();
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  // The dispatcher of this process and backplane that has a thread. The first call creates it; it
  // is destroyed with its last owner; clients that were given only a backplane are owners.
  // If a callback destroys the last owner, its thread ends after the callback, and exit() waits for
  // that.
  //   throws  as the constructor; std::system_error with EAGAIN when no thread can be started
  static std::shared_ptr<Dispatcher> shared(const Backplane& backplane);

  // Waits until there is something to do, and does some of it: delivers messages, connects clients,
  // ends expired requests. Returns false when the deadline passed first or interrupt() was called.
  //   throws  what a callback throws; std::logic_error when another thread runs the dispatcher
  bool runOnce(Deadline deadline = Deadline::never());
  // Runs until interrupt(). Throws as runOnce().
  void run();
  // Ends the call of run() or runOnce() that is in progress, or else the next one. If a callback
  // runs the dispatcher, ends its call and each one around it. Any thread; async-signal-safe.
  void interrupt() noexcept;

  // For event loops: poll() the descriptor for reading, at most until nextDeadline(), then call
  // runPending(), which makes the descriptor unreadable until there is something to do again. The
  // dispatcher owns the descriptor.
  //   throws  std::logic_error when another thread runs the dispatcher
  [[nodiscard]] int descriptor();
  // Does what can be done without waiting, in at most `batches` steps of some messages each.
  // Returns false when there may be more to do; the descriptor then stays readable.
  //   throws  as runOnce(); the descriptor then stays readable, too
  bool runPending(int batches = kPendingBatches);
  static constexpr int kPendingBatches = 1024;
  // When runPending() must run even if the descriptor is not readable: the next request expires, or
  // a connection is to be tried again.
  [[nodiscard]] Deadline nextDeadline() const noexcept;

  [[nodiscard]] const Backplane& backplane() const noexcept;

 private:
  friend class MessageClient;
  friend class Binding;
  friend class RelayDispatcher;
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace mpf
