// SPDX-License-Identifier: MIT
// MessageClient: a client of one server (manual, "Message Client").
//
//   mpf::MessageClient client(backplane, [](mpf::Message message) { ... });
//   client.bind("dac", 0);                                    // never waits; the server may come
//   later, go and come back client.send(mpf::Int32Message({.address = 3, .value = 100}));
//
// The callback gets replies, ConnectMessages (connected, disconnected, queue full) and
// RequestFateMessages, one at a time, in the order in which things happened. Each request that
// send() accepted ends in a reply or in exactly one fate.
//
// Threads  any thread may construct a client, bind, send, cancel and wait for the connection.
//          Callbacks run on the thread that runs the dispatcher, and may do all of that, too, and
//          end the client.
// Throws   a callback may throw: see Dispatcher. Each other request still gets its end, and the
//          client stays bound.
// Crash    a server that dies is reported, its requests get their fates, and the client binds again
//          when it is back.
// Trust    a server that writes nonsense loses this link and is treated as gone.
// Fork     in a child without exec, clients, servers and dispatchers of its parent refuse; the
//          child makes its own.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include <mpf/clock.h>
#include <mpf/dispatcher.h>
#include <mpf/message_of.h>

namespace mpf {

// What became of a send.
enum class SendResult {
  sent,
  notConnected,
  queueFull,
  tooManyOutstanding,
  tooLarge,
  noMemory,
  empty
};
[[nodiscard]] const char* toString(SendResult result) noexcept;

class MessageClient {
 public:
  using Callback = std::function<void(Message&&)>;

  // Callbacks run on the backplane's shared dispatcher thread.
  //   throws  as Dispatcher::shared()
  MessageClient(const Backplane& backplane, Callback callback);
  // Callbacks run where `dispatcher` runs, which must outlive the client.
  //   throws  std::bad_alloc; the memory of a connection is not needed before bind()
  MessageClient(Dispatcher& dispatcher, Callback callback);
  // After return no callback runs. On another thread than the one that runs the dispatcher it waits
  // until the callback that is running there has returned.
  ~MessageClient();
  MessageClient(const MessageClient&) = delete;
  MessageClient& operator=(const MessageClient&) = delete;

  // Binds to `server` at `location`, once in the client's life. What keeps it from a connection,
  // full shared memory for example, is in notConnectedBecause(), and it tries again.
  //   throws  std::invalid_argument for a name that cannot be one, std::logic_error when bound
  //           already
  void bind(const std::string& server, std::int32_t location = Backplane::defaultLocation());

  // Sends, and empties `message`; when the result is not `sent`, the message is as it was.
  //   takeBefore  a request that the server has not taken by then ends as `expired`
  //   requestId   out, when not null: names the request in cancel() and in its fate
  [[nodiscard]] SendResult send(Message&& message, Deadline takeBefore = Deadline::never(),
                                std::uint32_t* requestId = nullptr) noexcept;

  // An array message of n elements, in the memory that is shared with the server when there is a
  // connection. Throws std::bad_alloc.
  template <ArrayBody T>
  [[nodiscard]] MessageOf<T> alloc(std::size_t n) {
    return MessageOf<T>::inBuffer(allocate(MessageOf<T>::bytesFor(n)), n);
  }

  // Ends the request with the fate `cancelled`, if it has not ended yet. The server may act on it
  // all the same, and until it has replied to it or refused it, the request counts as outstanding.
  // In a callback the fate is delivered before cancel() returns, otherwise when the dispatcher runs
  // next, before any reply.
  void cancel(std::uint32_t requestId);

  // --- for routers, who are clients in the name of others; on the thread that runs the dispatcher
  // As send(), with an id of the caller's choice, not 0; tooManyOutstanding when another request is
  // in its way.
  [[nodiscard]] SendResult sendAs(std::uint32_t requestId, Message&& message,
                                  Deadline takeBefore) noexcept;
  // Whether a message that the callback got ended its request.
  [[nodiscard]] static bool endsRequest(const Message& message) noexcept {
    return message.route().flags == kEndsRequest;
  }
  // Until resume(), what the server sends waits in the link; when that is full, the server is told
  // so. Ends with the connection.
  void pause();
  void resume();
  // Memory to build the body of a request in, as alloc() uses it. Throws std::bad_alloc.
  [[nodiscard]] BodyBytes allocateBody(std::size_t bytes) { return allocate(bytes); }

  // Waits until the server is connected. Runs a dispatcher without a thread of its own meanwhile,
  // unless another thread runs it or ran it last: then it waits until that thread has connected the
  // client. SyncClient::connectWait() always runs its dispatcher.
  //   throws  what a callback throws that it runs
  [[nodiscard]] bool connectWait(Nanoseconds timeout);
  [[nodiscard]] bool isConnected() const noexcept;
  // Largest body that the server takes; 0 without a connection.
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept;
  // Why there is no connection, in words; empty when there is one.
  [[nodiscard]] std::string notConnectedBecause() const;

 private:
  friend class SyncClient;  // isInherited()
  MessageClient(std::shared_ptr<Dispatcher> shared, Callback callback);
  BodyBytes allocate(std::size_t bytes);
  [[nodiscard]] bool isInherited() const noexcept;
  std::shared_ptr<Dispatcher> shared_;  // when the dispatcher is the backplane's
  std::shared_ptr<Dispatcher::Impl> dispatcher_;
  std::shared_ptr<class Binding> binding_;
};

}  // namespace mpf
