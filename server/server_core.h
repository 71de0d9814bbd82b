// SPDX-License-Identifier: MIT
// ServerCore: waits for the requests of a MessageServer and takes them. Its parts accept clients,
// keep their connections and send replies.
//
//   clients ─► Acceptor ─► Connections ─► ServerCore ─► request, handler ─► ReplySender ─► clients
//                                                                  └► Publisher ───► clients
//
// Threads  as MessageServer: one thread owns it, any thread may reply.
// Crash    the links of a dead client are closed and their names removed.
// Trust    invalid data from a client closes its link.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <mpf/message.h>
#include <mpf/message_server.h>

#include "server/acceptor.h"
#include "server/connections.h"
#include "server/handlers.h"
#include "server/progress.h"
#include "server/publisher.h"
#include "server/reply_counts.h"
#include "server/reply_sender.h"
#include "server/request_keeper.h"
#include "shm/endpoint.h"
#include "shm/messages/message_run.h"

namespace mpf {

class ServerCore {
 public:
  //   hops  connections between routers over which requests reach the server; 0: this is the server
  ServerCore(const Backplane& backplane, const std::string& name, const ServerOptions& options,
             std::uint32_t hops = 0);
  ~ServerCore();

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::int32_t location() const noexcept { return location_; }
  void setQueueSize(int size);

  [[nodiscard]] Acceptor& acceptor() noexcept { return acceptor_; }
  [[nodiscard]] Connections& connections() noexcept { return connections_; }
  // Closes the window and all connections. Returns as Connections::closeAll().
  [[nodiscard]] Connections::Channels closeAll() noexcept;
  [[nodiscard]] ReplySender& replies() noexcept { return replies_; }
  [[nodiscard]] Publisher& publisher() noexcept { return publisher_; }
  [[nodiscard]] Handlers& handlers() noexcept { return handlers_; }

  bool wait(Deadline deadline);
  Message receive();
  // As receive(). If there is a handler for several requests that wait, calls it, sends the
  // replies, and returns an empty handle.
  //   throws  what the handler throws, and as receive()
  Message receiveOrHandleRun(bool& hasHandledRun);
  // As RelayServer::receive() with a run.
  Message receiveOrTakeRun(MessageRun& run, std::uint64_t& client, std::size_t most);
  // Calls a handler. The other requests wait if it throws.
  template <class Handle>
  void callHandler(const Handle& handle) try {
    const Handlers::Call call(handlers_);
    handle();
  } catch (...) {
    endHandling();
    keepReadable();
    throw;
  }
  void interrupt() noexcept;
  // Whether the next wait() returns immediately.
  [[nodiscard]] bool isInterrupted() const noexcept {
    return stop_.load(std::memory_order_relaxed);
  }
  // Clears the last received request in the window: it has been handled, or was kept.
  void endHandling() noexcept { progress_.end(); }
  [[nodiscard]] Deadline takeBefore() const noexcept {
    return takeBeforeNs_ == 0 ? Deadline::never() : Deadline::atNs(takeBeforeNs_);
  }
  int descriptor();
  // As Endpoint::setPolled().
  void setPolled(bool isPolled) noexcept { endpoint_.setPolled(isPolled); }
  // Keeps the descriptor readable, for requests that were not received yet.
  void keepReadable() noexcept;
  void countAlarm() noexcept { endpoint_.control().alarms.fetch_add(1, std::memory_order_relaxed); }

  // Exists while a thread is in MessageServer::run(). A handler may call it again.
  //   throws  std::logic_error when another thread is in it, and in the child of a fork
  class Run {
   public:
    explicit Run(ServerCore& core);
    ~Run();
    Run(const Run&) = delete;
    Run& operator=(const Run&) = delete;

   private:
    ServerCore& core_;
    bool isOutermost_ = false;
  };

  struct Counts {
    std::uint32_t queueSize;
    std::uint64_t inQueue, requests, queueFull, replies;
  };
  [[nodiscard]] Counts counts() const;

 private:
  void handleControlEvents();
  void throwNext();
  Link* nextOther();
  template <class TryHandle>
  Message receiveUnless(const TryHandle& tryHandle);
  bool hasRequest(Connection& connection) noexcept;
  bool tryHandleRun(Connection& connection);
  bool tryHandleRun(Connection& connection, MessageType type, const HandleRun& handle);
  bool tryTakeRun(Connection& connection, MessageRun& run, std::size_t most) noexcept;
  bool tryNoteTaken(Connection& connection, const MessageRun& run) noexcept;
  bool tryBegin(Connection& connection, Envelope& envelope) noexcept;
  Message finishShort(Connection& connection, const Envelope& envelope) noexcept;
  struct Times {
    std::uint32_t sentTick;
    std::int64_t deadlineNs;
  };
  Message finishLong(Connection& connection, BodyFields fields, RequestMarks marks,
                     Times times) noexcept;
  void noteTaken(Connection& connection, std::uint32_t requestId, Times times, MessageType type,
                 std::int32_t cmd) noexcept;
  void closeForProtocolError(Connection& connection) noexcept;
  static bool hasPassed(std::int64_t deadlineNs) noexcept;
  void noteTimes(Connection& connection, std::uint32_t requestId, std::uint32_t sentTick) noexcept;

  std::string name_;
  std::int32_t location_;
  Endpoint endpoint_;
  Connections connections_;
  Acceptor acceptor_;
  ReplyCounts replyCounts_;
  ReplySender replies_;
  Publisher publisher_;
  RequestKeeper& keeper_;
  Progress progress_;
  Handlers handlers_;
  std::int64_t takeBeforeNs_ = 0;  // of the request received last; 0: never
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> runner_{0};  // threadNumber() of the one that is in run(); 0: none
  bool hasDescriptor_ = false;
};

}  // namespace mpf
