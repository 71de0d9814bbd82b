// SPDX-License-Identifier: MIT
// SniffServer: sends every byte of a serial line or of a GPIB bus to listeners, as described in
// include/mpf/serial_sniff.h and gpib_sniff.h.
//
//   line's thread ── tap ──► SniffQueue ── own thread ──► a batch ──► listener 1, listener 2, ...
//
// The tap is attached while there are listeners; the thread sleeps while there is nothing to send.
//
// Threads  its own thread waits for requests and bytes, and never for a listener. The line's thread
//          copies records into the queue and wakes it.
// Crash    a listener that dies is removed when the server notices its death.
// Trust    a listener that does not receive its messages loses bytes; the next message counts them.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <mpf/message_server.h>
#include <mpf/serial_sniff.h>

#include "server/programs/server_log.h"
#include "server/programs/serving_thread.h"
#include "server/programs/sniff/sniff_queue.h"

namespace mpf {

// Attaches a tap to a line or bus: shows the record of each byte to `show`, on the threads of the
// line, until the returned object is destroyed.
using SniffSource =
    std::function<std::shared_ptr<void>(std::function<void(std::span<const SniffBytes>)> show)>;

class SniffServer {
 public:
  // Serves "<server>.sniff" at the location and with the rights of `like`.
  //   source  the objects that it uses must outlive this
  //   throws  as MessageServer
  SniffServer(const Backplane& backplane, const std::string& server, const ServerOptions& like,
              SniffSource source, const ServerLog& log, const SniffBatching& batching = {});
  ~SniffServer();
  SniffServer(const SniffServer&) = delete;
  SniffServer& operator=(const SniffServer&) = delete;

  // Serves until this object is destroyed. `failed` is called when the server has failed, after it
  // has logged the error.
  void start(std::function<void()> failed);
  [[nodiscard]] const std::string& getName() const noexcept { return server_.getName(); }
  // How many clients listen now.
  [[nodiscard]] std::size_t listeners() const noexcept {
    return count_.load(std::memory_order_relaxed);
  }

 private:
  struct Listener {
    Int32Message request;  // cmdSniffStart; the records are further replies to it
    std::uint64_t client = 0;
    std::uint64_t lost = 0;  // bytes that are missing and not reported yet
  };

  void run();
  void handle(Int32Message&& request);
  void listen(Int32Message&& request);
  void leave(const Int32Message& request);
  void answer(const Int32Message& request, std::int32_t status, std::uint64_t lost = 0);
  [[nodiscard]] std::vector<Listener>::iterator find(std::uint64_t client);
  void forgetGone();
  void followCount();
  void deliver();
  void send(Listener& listener);

  const ServerLog& log_;
  const SniffSource source_;
  SniffQueue queue_;
  MessageServer server_;
  std::vector<Listener> listeners_;  // this and below: the thread's
  std::shared_ptr<void> tap_;  // exists while there are listeners; destroyed before the queue
  std::vector<SniffBytes> records_;  // of the batch that is being delivered
  std::atomic<std::size_t> count_{0};
  std::atomic<bool> ends_{false};
  ServingThread thread_;
};

}  // namespace mpf
