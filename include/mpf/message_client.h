// SPDX-License-Identifier: MIT
// MessageClient: a client of one server (manual, "Message Client").
//
//   mpf::MessageClient client(backplane, [](mpf::Message message) { ... });
//   client.bind("dac", 0);  // never waits; the server may start later, and restart
//   const auto result = client.send(mpf::Int32Message({.address = 3, .value = 100}));
//
// The callback receives replies, ConnectMessages (connected, disconnected, queue full) and
// RequestFateMessages, one at a time, in the order of the events. Only a callback that runs the
// dispatcher itself (connectWait(), runOnce()) may see others begin and return inside it, also of
// its own client. Each request that send() accepted ends in exactly one reply or one fate; a server
// may send further replies after the first.
//
// Threads  any thread may construct a client, bind, send, cancel and wait for the connection.
//          Callbacks run on the thread that runs the dispatcher; they may call all functions of the
//          client and destroy it. No other thread may then be in a function of that client.
// Throws   a callback may throw: see Dispatcher. All other requests still get their reply or fate,
//          and the client stays bound.
// Crash    when a server dies, the client delivers the replies that the server had sent, a fate for
//          each other request, and a ConnectMessage. It connects again when the server restarts.
// Trust    a server that sends invalid data loses the connection, as if it had died.
// Fork     a child process that does not call exec cannot use the clients, servers and dispatchers
//          of its parent: they refuse with an error. The child creates its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

#include <mpf/clock.h>
#include <mpf/dispatcher.h>
#include <mpf/message_of.h>

namespace mpf {

// The result of a send.
enum class SendResult {
  sent,  // the request will end in a reply or a fate
  notConnected,  // see MessageClient::notConnectedBecause()
  queueFull,  // the server has not taken the earlier requests yet
  tooManyOutstanding,  // too many requests without a reply
  tooLarge,  // larger than MessageClient::maxMessageBytes()
  noMemory,  // the shared memory of the connection, or /dev/shm, is full
  empty  // the handle has no message
};
// The result in words, for messages to people.
[[nodiscard]] const char* toString(SendResult result) noexcept;

// The result of MessageClient::sendMany().
struct SentMany {
  std::size_t count = 0;  // messages that were sent
  SendResult result = SendResult::sent;  // why the next one was not; `sent` when all were
};

// Which requests a client resends automatically.
enum class Retry {
  never,
  // Those whose fate would be neverTaken, for example because the server was stopped or replaced.
  // They go to the next server with this name. No request is executed twice because of this.
  neverTaken
};

class MessageClient {
 public:
  // Owns the message that it receives.
  using Callback = std::function<void(Message&&)>;

  // Callbacks run on the thread of the shared dispatcher of the backplane.
  //   throws  as Dispatcher::shared(); std::invalid_argument when `callback` is empty
  MessageClient(const Backplane& backplane, Callback callback);
  // Callbacks run on the thread that runs `dispatcher`, which must outlive the client.
  //   throws  std::invalid_argument when `callback` is empty, std::logic_error when `dispatcher`
  //           was made before a fork, std::bad_alloc; bind() allocates the memory of the connection
  MessageClient(Dispatcher& dispatcher, Callback callback);
  // No callback runs after the destructor has returned. Unless it is called on the thread that runs
  // the dispatcher, it waits until the callback in progress, of any client of the dispatcher, has
  // returned, even if that callback runs the dispatcher.
  ~MessageClient();
  MessageClient(const MessageClient&) = delete;
  MessageClient& operator=(const MessageClient&) = delete;

  // Binds to `server` at `location` (manual, "Message Client"), once for each client. Returns
  // without waiting; the callback receives a ConnectMessage when the connection is made. When a
  // connection fails, for example because /dev/shm is full, notConnectedBecause() returns the
  // reason and the client tries again.
  //   throws  std::invalid_argument when `server` is not a valid name, std::logic_error when the
  //           client is already bound, and in the child of a fork, std::bad_alloc; then the client
  //           is not bound
  void bind(const std::string& server, std::int32_t location = Backplane::defaultLocation());

  // Sets the callback for replies of type T whose body is valid. Call it once, before bind(). If T
  // is Int32 or OutOfBand, it gets up to 16 consecutive replies together: replies to one request,
  // or the first replies to requests with the same clientType and clientExtra. Other types arrive
  // one by one. All other messages go to the callback of the constructor.
  //
  //   client.onValues<mpf::Int32>(
  //       [&](std::span<const mpf::Int32> values, const mpf::Message& first) { ... });
  //
  //   values  at least one, in the order of the replies; copies, valid until the callback returns
  //   first   the message of the first value. All values have its clientType, clientExtra and time
  //           stamp. They are replies to one request, or first replies to one request each, which
  //           they end
  //   throws  std::invalid_argument when `callback` is empty, std::logic_error when the client is
  //           bound already, or onValues() was called before, for any type
  // A callback that throws has received all of the values.
  template <ScalarBody T>
  void onValues(std::function<void(std::span<const T> values, const Message& first)> callback) {
    static_assert(T::kType != MessageType::connect && T::kType != MessageType::requestFate);
    static_assert(sizeof(T) <= Message::kInlineBytes);
    if (!callback) throw std::invalid_argument("MessageClient::onValues(): an empty callback");
    setValueHandler(
        T::kType, sizeof(T),
        [callback = std::move(callback)](std::span<const std::byte> values, const Message& first) {
          callback({reinterpret_cast<const T*>(values.data()), values.size() / sizeof(T)}, first);
        });
  }

  // Sends `message` and empties it. When the result is not `sent`, the message is unchanged. Never
  // waits.
  //   takeBefore  a request that the server has not taken by then ends as `expired`
  //   requestId   out, unless null: the number of the request, for cancel() and in its fate
  //   retry       with neverTaken, the client keeps a copy, made by duplicate(), until the request
  //               ends. If no server takes the request, the client sends it again when it is
  //               connected again, under the same number and with the same deadline. While such
  //               requests wait, send() returns `queueFull`, so that requests keep their order
  [[nodiscard]] SendResult send(Message&& message, Deadline takeBefore = Deadline::never(),
                                std::uint32_t* requestId = nullptr,
                                Retry retry = Retry::never) noexcept;

  // Sends the messages in order, until one is not sent. A sleeping server is woken at most once.
  // Messages that were sent are empty afterwards; the others are unchanged. Never waits, and never
  // resends.
  //   takeBefore  as send(), for each message
  //   requestIds  out: the numbers of the requests that were sent; may be shorter, and is then
  //               filled as far as it goes
  SentMany sendMany(std::span<Message> messages, Deadline takeBefore = Deadline::never(),
                    std::span<std::uint32_t> requestIds = {}) noexcept;

  // Sends each of `values` as a request, in order, until one is not sent. Use it for many small
  // requests: if T is Int32 or OutOfBand and both sides poll, it is faster than sendMany() of
  // messages. The clientType and clientExtra of the requests are 0: a field of the value must
  // identify the request in its reply, and its number identifies it in a fate.
  //
  //   const auto sent = client.sendMany<mpf::Int32>(settings);  // std::vector<mpf::Int32> settings
  //
  //   takeBefore, requestIds  as above
  template <ScalarBody T>
  SentMany sendMany(std::span<const T> values, Deadline takeBefore = Deadline::never(),
                    std::span<std::uint32_t> requestIds = {}) noexcept {
    static_assert(T::kType != MessageType::connect && T::kType != MessageType::requestFate);
    static_assert(sizeof(T) <= Message::kInlineBytes);
    return sendBodies(T::kType, sizeof(T), std::as_bytes(values), takeBefore, requestIds);
  }

  // Allocates an array message of n elements in the memory that is shared with the server. Sending
  // it copies nothing. Without a connection, or when the shared memory is full, the message is on
  // the heap, and sending it copies it.
  //   throws  std::bad_alloc; std::length_error when n is above 2^32 - 1
  template <ArrayBody T>
  [[nodiscard]] MessageOf<T> alloc(std::size_t n) {
    return MessageOf<T>::inBuffer(allocate(MessageOf<T>::bytesFor(n)), n);
  }

  // Ends the request with the fate `cancelled`, if it has not ended yet. The server may still act
  // on the request, which counts as outstanding until the server has replied to it or refused it.
  // Called in a callback, cancel() delivers the fate before it returns; otherwise the dispatcher
  // delivers it when it runs next, before any reply.
  //   throws  in a callback: the exception of the callback that receives the fate
  void cancel(std::uint32_t requestId);

  // --- the connection

  // Waits until the client is connected; returns false after `timeout`. If the dispatcher has a
  // thread, or another thread runs it or ran it last, the call waits for that thread; otherwise it
  // runs the dispatcher itself. SyncClient::connectWait() always runs its dispatcher. When a
  // callback that it runs destroys the client, it returns false.
  //   throws  the exception of a callback that it runs
  [[nodiscard]] bool connectWait(Nanoseconds timeout);
  [[nodiscard]] bool isConnected() const noexcept;
  // [bytes] The largest body that the server accepts; 0 without a connection.
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept;
  // The process of the server; at another location, that of the router to it. 0 without a
  // connection, and if the process is in another pid namespace.
  [[nodiscard]] std::int32_t serverPid() const noexcept;
  // The reason why the client is not connected, in words; empty when it is connected.
  [[nodiscard]] std::string notConnectedBecause() const;

 private:
  friend class SyncClient;  // for isInherited()
  friend class RelayClient;  // internal, for routers
  MessageClient(std::shared_ptr<Dispatcher> shared, Callback callback);
  void setValueHandler(
      MessageType type, std::size_t size,
      std::function<void(std::span<const std::byte> values, const Message& first)> callback);
  // Bodies of `size` bytes each, one after the other.
  SentMany sendBodies(MessageType type, std::size_t size, std::span<const std::byte> bodies,
                      Deadline takeBefore, std::span<std::uint32_t> requestIds) noexcept;
  BodyBytes allocate(std::size_t bytes);
  [[nodiscard]] bool isInherited() const noexcept;
  std::shared_ptr<Dispatcher> shared_;  // null when the client was given a dispatcher
  std::shared_ptr<Dispatcher::Impl> dispatcher_;
  std::shared_ptr<class Binding> binding_;
};

}  // namespace mpf
