// SPDX-License-Identifier: MIT
// SniffServer: lets clients see every byte of a serial line, as include/mpf/serial_sniff.h promises
// them.
//
//   port's thread ── tap ──► SniffQueue ── own thread ──► a batch ──► listener 1, listener 2, ...
//
// The tap is attached while somebody listens, and the thread sleeps while there is nothing to tell.
//
// Threads  its own, which waits for the line and for nobody else. The port's thread copies bytes
//          into a queue and rings.
// Crash    a listener that dies is forgotten as soon as its death is known.
// Trust    a listener that does not take its messages loses bytes, and is told how many.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <mpf/drivers/serial/serial_port.h>
#include <mpf/message_server.h>
#include <mpf/serial_sniff.h>

#include "server/programs/serial_server/sniff_queue.h"
#include "server/programs/server_log.h"
#include "server/programs/serving_thread.h"

namespace mpf {

class SniffServer {
 public:
  // Serves "<server>.sniff" at the location and with the rights of `like`.
  //   port    must outlive this
  //   throws  as MessageServer
  SniffServer(const Backplane& backplane, const std::string& server, const ServerOptions& like,
              SerialPort& port, const ServerLog& log, const SniffBatching& batching = {});
  ~SniffServer();
  SniffServer(const SniffServer&) = delete;
  SniffServer& operator=(const SniffServer&) = delete;

  // Serves, until this object ends. `failed` is called when it cannot any more, which the log says.
  void start(std::function<void()> failed);
  [[nodiscard]] const std::string& getName() const noexcept { return server_.getName(); }
  // How many clients listen now.
  [[nodiscard]] std::size_t listeners() const noexcept {
    return count_.load(std::memory_order_relaxed);
  }

 private:
  struct Listener {
    Int32Message request;  // its start, which the records are replies to
    std::uint64_t client = 0;
    std::uint64_t lost = 0;  // bytes that it has not been told of
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
  SerialPort& port_;
  SniffQueue queue_;
  MessageServer server_;
  std::vector<Listener> listeners_;  // this and below: the thread's
  std::optional<PeekTap> tap_;  // there while somebody listens; ends before what it pushes to
  std::vector<PeekedByte> bytes_;  // of the batch that is being delivered
  std::vector<char> records_;  // the same, as listeners get it
  std::atomic<std::size_t> count_{0};
  std::atomic<bool> ends_{false};
  ServingThread thread_;
};

}  // namespace mpf
