// SPDX-License-Identifier: MIT
// Requester: the requests of one Python client. It contains no Python.
//
//   thread A ── waits ─┐   one of the waiting threads runs the dispatcher; it gives the answers
//   thread B ── waits ─┼─► of the others to them
//   event loop ────────┘   runPending(), when descriptor() is readable
//
// Threads  any. Either threads wait, or an event loop calls runPending(), not both.
// Crash    as MessageClient: each request ends with a reply or a fate.
// Fork     as MessageClient: a child cannot use the requesters of its parent.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <mpf/message_client.h>

#include "python/extension/exchanges.h"

namespace mpf::python {

class Requester {
 public:
  //   throws  as SyncClient
  Requester(const Backplane& backplane, const std::string& server, std::int32_t location,
            WaitMode waitMode);
  ~Requester();
  Requester(const Requester&) = delete;
  Requester& operator=(const Requester&) = delete;

  // Runs before a wait and during it, about ten times a second; returns true to end the wait.
  using IsInterrupted = std::function<bool()>;

  // Waits for the connection; returns false after the deadline or an interruption.
  bool connect(Deadline deadline, const IsInterrupted& isInterrupted);
  // Sends `message` as the request of `exchange`, which must live until forget().
  SendResult send(Message&& message, Exchange& exchange, Deadline takeBefore, Retry retry);
  // Sends messages[i] as the request of *exchanges[i], as MessageClient::sendMany(). The exchanges
  // of those that were sent must live until forget().
  SentMany sendMany(std::span<Message> messages, std::span<Exchange* const> exchanges,
                    Deadline takeBefore);
  // Handles what has arrived, without waiting for more: a program that sends and never waits needs
  // it to get room for further requests. Without effect if an event loop does it.
  void takeArrived();
  // Waits until `exchange` has ended. After the deadline it ends as `expired` or `outcomeUnknown`,
  // after an interruption as `cancelled`.
  void waitForEnd(Exchange& exchange, Deadline deadline, const IsInterrupted& isInterrupted);
  // Waits for the next further reply of `exchange`. Empty after the deadline, after an interruption
  // and when the connection has ended.
  Message waitForFurther(Exchange& exchange, Deadline deadline, const IsInterrupted& isInterrupted);
  // Returns the next further reply of `exchange`, or an empty handle.
  Message takeFurther(Exchange& exchange);
  // Returns the reply of `exchange`, which has ended with one.
  Message takeReply(Exchange& exchange);
  [[nodiscard]] bool hasEnded(const Exchange& exchange);
  [[nodiscard]] bool isDisconnected(const Exchange& exchange);
  [[nodiscard]] std::uint64_t missed(const Exchange& exchange);
  // Ends a request that has no reply as `cancelled`.
  void cancel(Exchange& exchange);
  // Drops later replies to `exchange`, which ends as `cancelled` if it has not ended.
  void forget(Exchange& exchange);

  // Ends all requests as `cancelled` and all waits; exchanges need no forget() afterwards. The
  // destructor disconnects.
  void close();

  // --- for event loops
  [[nodiscard]] int descriptor() { return dispatcher_.descriptor(); }
  [[nodiscard]] Deadline nextDeadline() const noexcept { return dispatcher_.nextDeadline(); }
  // Handles what has arrived, and returns the numbers of the requests that it belongs to; 0 stands
  // for a change of the connection.
  std::vector<std::uint32_t> runPending();

  [[nodiscard]] MessageClient& client() noexcept { return client_; }

 private:
  void take(Message&& message);
  void takeAnswer(Exchange& exchange, Message&& message);
  void keepReply(Exchange& exchange, Message&& reply);
  void freeReply(Exchange& exchange) noexcept;
  void takeConnect(const Connect& connect);
  template <class Done>
  bool wait(const Done& isDone, Deadline deadline, const IsInterrupted& isInterrupted);
  template <class Run>
  void runDispatcher(std::unique_lock<std::mutex>& lock, const Run& run);
  class Turn;
  void lookOnceMore(std::unique_lock<std::mutex>& lock, const Exchange& exchange);

  Dispatcher dispatcher_;
  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;  // an exchange has changed, or no thread runs the dispatcher
  bool isRunning_ = false;  // a thread runs the dispatcher
  int turns_ = 0;  // threads with a Turn, which run it before those that wait
  Exchanges exchanges_;
  int borrowed_ = 0;  // replies in exchanges whose memory is that of the connection
  std::vector<std::uint32_t> events_;
  bool keepsEvents_ = false;
  bool isClosed_ = false;
  MessageClient client_;
};

}  // namespace mpf::python
