// SPDX-License-Identifier: MIT
// DigitalInputServer: sends the inputs of a digital module, and their changes, to clients, as
// described in include/mpf/digital_io_commands.h.
//
//   driver's thread ── changes ──► queue ── own thread ──► monitor 1, monitor 2, ...
//
// Threads  its own thread waits for requests and changes, and never for a client. It sends changes
//          before it receives the next request.
// Crash    the monitor of a client that dies is removed when the server notices its death.
// Trust    the changes for a client that does not receive its messages are merged into one, which
//          is sent again until the client has room for it. When too many changes of the inputs are
//          queued, further ones are merged into the last.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <mpf/clock.h>
#include <mpf/digital_io_commands.h>
#include <mpf/message_server.h>

#include "drivers/digital_io/digital_io.h"
#include "server/programs/hardware/fault_note.h"
#include "server/programs/server_log.h"
#include "server/programs/serving_thread.h"

namespace mpf {

class DigitalInputServer {
 public:
  //   io      must outlive this, as `log`
  //   failed  called when the server has failed, after it has logged the error
  //   throws  as MessageServer
  DigitalInputServer(const Backplane& backplane, const std::string& name,
                     const ServerOptions& options, DigitalIo& io, const ServerLog& log,
                     std::function<void()> failed);
  ~DigitalInputServer();
  DigitalInputServer(const DigitalInputServer&) = delete;
  DigitalInputServer& operator=(const DigitalInputServer&) = delete;

  [[nodiscard]] const std::string& getName() const noexcept { return server_.getName(); }
  // How many clients have a monitor now.
  [[nodiscard]] std::size_t monitors() const noexcept {
    return count_.load(std::memory_order_relaxed);
  }

 private:
  struct Monitor {
    Int32Message request;  // cmdStartMonitor; the changes are further replies to it
    std::uint64_t client = 0;
    std::uint32_t mask = 0;
    std::optional<Int32> unsent = {};  // the client had no room for it; later changes are merged in
  };

  void run();
  void handle(Int32Message&& request);
  void start(Int32Message&& request);
  [[nodiscard]] std::int32_t stop(const Int32Message& request);
  void read(Int32& fields);
  void answer(const Int32Message& request, const Int32& fields);
  void enqueue(const DigitalIoChange& change);
  void deliver();
  void note(const DigitalIoChange& change);
  // Return false when the client is gone.
  [[nodiscard]] bool send(Monitor& monitor, std::uint32_t changed);
  [[nodiscard]] bool trySend(Monitor& monitor, const Int32& fields);
  void sendAgain();
  [[nodiscard]] std::vector<Monitor>::iterator find(std::uint64_t client);
  void forgetGone();
  void followCount();

  DigitalIo& io_;
  const ServerLog& log_;
  MessageServer server_;
  FaultNote faults_;  // of reads; used by the server's thread, as monitors_
  std::vector<Monitor> monitors_;
  DigitalIo::State state_;  // after the last change that was delivered
  Deadline sendAgainAt_ = Deadline::never();  // never when all messages were sent
  std::mutex mutex_;
  std::deque<DigitalIoChange> changes_;  // under mutex_
  std::atomic<std::size_t> count_{0};
  std::atomic<bool> ends_{false};
  DigitalIo::Subscription subscription_;
  ServingThread thread_;
};

}  // namespace mpf
