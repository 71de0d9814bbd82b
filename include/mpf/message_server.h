// SPDX-License-Identifier: MIT
// MessageServer: a named server on a backplane (manual, "Message Server").
//
//   mpf::MessageServer server(mpf::Backplane::attach(), "dac");
//   server.on<mpf::Int32>([&](mpf::Int32& request) {
//     request.status = dac.trySetCounts(request.address, request.value) ? 0 : -1;
//   });
//   return server.runUntilSignal();
//
// or without run(), with replies now or later, one or many:
//
//   while (server.waitForMessage()) {
//     while (mpf::Message request = server.receive()) { ...; server.reply(std::move(request)); }
//   }
//
// Threads  one thread waits and receives; any thread may call reply(), replyMany(),
//          allocReplyMessage(), allocShared(), publish(), refuse(), isClientConnected(),
//          countAlarm() and interrupt().
//          A handler must not destroy its server.
// Fork     in the child of a fork, the parent's servers refuse to work: waitForMessage(), receive()
//          and what calls them, descriptor(), setQueueSize() and report() throw std::logic_error;
//          reply(), replyMany() and publish() return clientGone, clientOf() 0, isClientConnected()
//          false; messages are allocated on the heap; interrupt(), countAlarm() and the
//          destructors of servers and handles change nothing of the parent.
// Crash    when a client dies, the handles of its requests stay valid; replies to them return
//          clientGone. Its shared memory is freed when the last of these handles is destroyed;
//          published messages that it held are freed at once.
// Trust    a client that sends invalid data loses its connection; other clients are not affected.
// Throws   an exception that leaves a handler leaves run(), runUntilSignal() or handleOne(); the
//          requests that it was called with, if they had no reply, end as `refused`. An exception
//          that leaves the callback of onClient() leaves receive() and what calls it. Nothing else
//          is lost, and the next call continues with the remaining requests. An exception that
//          main() does not catch ends the program: the request and all others that were taken end
//          as `outcomeUnknown`. Clients follow the same rule: see Dispatcher.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <mpf/backplane.h>
#include <mpf/clock.h>
#include <mpf/detail/handler_argument.h>
#include <mpf/message_of.h>
#include <mpf/rights.h>
#include <mpf/wait_mode.h>

namespace mpf {

struct ServerOptions {
  std::int32_t location = Backplane::defaultLocation();
  // Requests of one client that may wait, 1 to 16384; twice as many may have no reply yet. Bodies
  // of up to 24 bytes, such as those of Int32, always have room, as requests and as first replies.
  // Longer ones may need one of 256 chunks of memory for each direction: if more than 256 wait,
  // further ones may be refused with noMemory.
  int queueSize = 100;
  std::uint64_t maxMessageBytes = 64ull << 20;  // [bytes] largest body of a request or a reply
  std::uint64_t maxPoolBytes = 320ull << 20;  // [bytes] of large messages, per client and direction
  WaitMode waitMode = WaitMode::adaptive;  // how waitForMessage() waits
  Rights rights{};  // which users may bind: mode 0660 and a group admit the members of the group
  // Whether a reply without a time stamp (Message::setTimeStampNs()) gets that of its sending.
  bool stampsReplies = false;
  // [bytes] Memory of the messages made by allocShared(), together for all clients.
  std::uint64_t maxSharedBytes = 320ull << 20;
  // Published messages that one client may hold, 1 to 64: those that it has not taken and those
  // whose handles it has not destroyed. Above this number, publish() drops messages for the client.
  int maxBorrowed = 4;
};

// The result of a reply.
enum class ReplyResult {
  sent,
  clientGone,  // the client has disconnected or died, or the message is not a reply
  queueFull,  // further replies only: the client has not taken the earlier ones yet; publish()
  // only: the client holds ServerOptions::maxBorrowed published messages
  tooLarge,  // larger than ServerOptions::maxMessageBytes
  noMemory  // the shared memory of the connection, that of publish(), or /dev/shm, is full
};
// The result in words, for messages to people.
[[nodiscard]] const char* toString(ReplyResult result) noexcept;

// The result of MessageServer::replyMany().
struct RepliedMany {
  std::size_t count = 0;  // replies sent, and messages whose client is gone
  ReplyResult result = ReplyResult::sent;  // why the next one was not sent; `sent` when all were
};

class MessageServer {
 public:
  // Publishes the server under `name`. receive(), handleOne() and run() accept clients; requests of
  // accepted clients wait in queues.
  //   throws  NameInUse when another process serves that name at that location, SegmentError when
  //           /dev/shm has a file of this name that is not a server, std::invalid_argument when the
  //           name or an option is invalid, std::system_error, for example ENOSPC when /dev/shm is
  //           full, EMFILE when the process has no file descriptor left
  MessageServer(const Backplane& backplane, const std::string& name,
                const ServerOptions& options = {});
  // Disconnects all clients. Requests that were not taken end as `neverTaken`, others without a
  // reply as `outcomeUnknown`. Handles of requests may outlive the server.
  ~MessageServer();
  MessageServer(const MessageServer&) = delete;
  MessageServer& operator=(const MessageServer&) = delete;

  [[nodiscard]] const std::string& getName() const noexcept;
  [[nodiscard]] std::int32_t location() const noexcept;
  // Sets the number of requests of one client that may wait, for clients that connect from now on.
  //   throws  std::invalid_argument when `size` is not from 1 to 16384
  void setQueueSize(int size);

  // Waits until receive() may have a request. Returns false when the deadline passed or interrupt()
  // was called.
  bool waitForMessage(Deadline deadline = Deadline::never());
  // Takes the next request; returns an empty handle when no request waits. Also accepts clients and
  // closes the connections of dead ones. A request whose deadline has passed ends as `expired` and
  // is not taken. A request ends as `refused` when its handle is destroyed before a reply.
  //   throws  what the callback of onClient() throws; std::logic_error in the child of a fork
  Message receive();
  // Ends the call of waitForMessage() or run() that is in progress, or else the next one; waiting
  // requests stay in their queues. In a handler, waitForMessage() returns false from then on, and
  // run() ends after the handler. Any thread; async-signal-safe.
  void interrupt() noexcept;
  // Returns a number for the connection that `request` was received on; 0 when it is closed. Two
  // connections of this server never have the same number. A handle that was emptied, by reply() or
  // because its message was moved, still names its request: here and for isClientConnected(),
  // allocReplyMessage() and replyMany() with values, which send further replies then.
  [[nodiscard]] std::uint64_t clientOf(const Message& request) const noexcept;
  // Whether that client is still connected and alive. Any thread, also during a handler: clientOf()
  // notices a dead client only when the thread of the server has called receive() again.
  [[nodiscard]] bool isClientConnected(const Message& request) const noexcept;
  // Sets a callback for clients that connect (isConnected true), and that disconnect or die
  // (false), so that a server can release what it holds for a client. receive() calls it: before
  // it returns the first request of the client, and after it has returned the last one. The
  // destructor of the server does not call it. Set it before the first receive(). The callback may
  // reply, but must not call receive(), handleOne() or run(). When it throws, receive() finishes
  // its work on the connections and then throws the same exception.
  //   client  the number that clientOf() returns for the requests of the client
  void onClient(std::function<void(std::uint64_t client, bool isConnected)> callback);

  // Returns a reply to `request`, with its clientType and clientExtra and all fields 0 (manual,
  // "Message Server"). Send it with reply(), before or after a reply that reuses the request
  // itself.
  template <ScalarBody T>
  [[nodiscard]] MessageOf<T> allocReplyMessage(const Message& request) {
    MessageOf<T> message;
    address(message, request);
    return message;
  }
  // The same for an array of n elements, in the memory that is shared with the client, or on the
  // heap when that is full or the client is disconnected.
  //   throws  std::bad_alloc; std::length_error when n is above 2^32 - 1
  template <ArrayBody T>
  [[nodiscard]] MessageOf<T> allocReplyMessage(const Message& request, std::size_t n) {
    auto message = MessageOf<T>::inBuffer(allocate(request, MessageOf<T>::bytesFor(n)), n);
    address(message, request);
    return message;
  }
  // Sends `message` to the client whose request it replies to. `message` is a request, changed or
  // not, or was made by allocReplyMessage(). sent and clientGone empty it; the other results leave
  // it unchanged. The first reply ends the request. Further replies are refused with queueFull when
  // the client does not take them: at least 16 may wait, and at least an eighth of
  // ServerOptions::queueSize, if their bodies have up to 24 bytes or more than 192; those between
  // count as up to four. With the default of 100, 47 may wait after the first reply.
  // Any thread; never waits.
  ReplyResult reply(Message&& message);
  // Sends replies in order, as reply() does, and stops at the first that is not sent. Those whose
  // client is gone are skipped and counted. A sleeping client is woken at most once for consecutive
  // replies to it. Replies that were counted are empty afterwards; the others are unchanged. Any
  // thread; never waits.
  RepliedMany replyMany(std::span<Message> replies) noexcept;
  // Sends each of `values` as a reply to `request`, in order, until one is not sent. Use it to send
  // many numbers to a subscriber: it is faster than a message for each of them.
  //
  //   server.replyMany<mpf::Int32>(subscriber, readings);  // std::vector<mpf::Int32> readings
  //
  // The first reply ends the request, as with reply(). A sleeping client is woken once for up to
  // 1024 values. Any thread; never waits.
  //   request  stays with the caller, who can reply to it again; or a handle that it was moved out
  //            of, or that reply() has emptied: see clientOf()
  //   values   with ServerOptions::stampsReplies, up to 1024 consecutive ones share a time stamp
  //   returns  the number of values that were sent; `result` is clientGone when the client is gone
  template <ScalarBody T>
  RepliedMany replyMany(const Message& request, std::span<const T> values) noexcept {
    static_assert(sizeof(T) <= Message::kInlineBytes);
    return replyBodies(request, T::kType, sizeof(T), std::as_bytes(values));
  }
  // Ends a request without a reply: its client gets the fate `refused`.
  void refuse(Message&& request);

  // --- one message for many clients
  //
  //   std::vector<mpf::Message> subscribers;  // requests that the server keeps
  //   auto image = server.allocShared<mpf::Int32Array>(pixels);
  //   camera.read(image.value());
  //   server.publish(image, subscribers);     // nothing is copied; image is destroyed as usual

  // Returns an array of n elements, fields 0, elements not initialised, in memory that all clients
  // of this server can read and only the server can write; on the heap when that memory is full.
  // The memory is free again when the server and all clients have destroyed their handles; a client
  // that was killed holds none. Do not write to the message after it was published: clients
  // would see it change.
  //   throws  std::bad_alloc; std::length_error when n is above 2^32 - 1
  template <ArrayBody T>
  [[nodiscard]] MessageOf<T> allocShared(std::size_t n) {
    return MessageOf<T>::inBuffer(allocateShared(MessageOf<T>::bytesFor(n)), n);
  }
  // Sends `message` as a reply to each of `requests`, which the server keeps: the first reply to a
  // request ends it, the others are further replies. A message of allocShared() is not copied; any
  // other message is copied once. Each client gets the clientType and the clientExtra of its own
  // request, and may write to what it receives: that changes neither the message of another client
  // nor the server's. Any thread; never waits.
  //
  // A client that holds ServerOptions::maxBorrowed published messages gets no more until it has
  // destroyed one: the result is queueFull, and no other client is affected. The next message that
  // is published to the same request tells it how many it has missed (queueFull and noMemory):
  // Message::getMissed().
  //
  //   message   keeps its contents, and may be published again, to these or other requests
  //   requests  unchanged; a request of another server, or an empty handle, also one that was moved
  //             from or replied to, gives clientGone
  //   results   out: the result for each request; may be shorter, and is then filled as far as it
  //             goes
  //   returns   the number of results `sent`
  std::size_t publish(const Message& message, std::span<const Message> requests,
                      std::span<ReplyResult> results = {}) noexcept;
  // The same for one request.
  ReplyResult publish(const Message& message, const Message& request) noexcept {
    ReplyResult result{};
    publish(message, std::span(&request, 1), std::span(&result, 1));
    return result;
  }

  // Sets the handler that run() and handleOne() call for requests of type T. A handler may call
  // on() to replace itself. If there is no memory for a reply, the request ends as `refused`.
  // What a handler gets depends on its parameter:
  //
  //   T&               the fields of one request, which is then sent as the reply
  //   MessageOf<T>&    one request as a handle, which is then sent as the reply
  //   MessageOf<T>&&   the same; the handler owns the request and replies to it, now or later
  //   std::span<T>     the fields of up to 16 waiting requests of one client, scalars. They are
  //                    sent as the replies, in order, after the handler has returned. A request
  //                    comes alone if it has a deadline, or T is neither Int32 nor OutOfBand. While
  //                    both sides poll, this handles more requests per second than T&; with
  //                    WaitMode::block, fewer
  //
  // A handler returns void. The compiler refuses other handlers, also those that take a copy or a
  // const reference: their changes would not reach the client.
  //   throws  std::invalid_argument when `handler` is an empty std::function or a null pointer
  template <MessageBody T, class Handler>
  void on(Handler handler) {
    static_assert(!detail::kIsNotification<T>,
                  "Connect and RequestFate are notifications for the callback of a client, and "
                  "never requests");
    using Argument = detail::HandlerArgument<T, Handler>;
    static_assert(!std::is_void_v<Argument>,
                  "the handler takes T& (a reference: the changed request is the reply), "
                  "MessageOf<T>&, MessageOf<T>&& or, if T is a scalar, std::span<T>");
    if constexpr (!std::is_void_v<Argument>) {
      static_assert(std::is_void_v<std::invoke_result_t<Handler&, Argument>>,
                    "a handler returns void: its result would be ignored; to tell it to the "
                    "client, set a field of the request, for example `status`");
      if (detail::isEmptyHandler(handler)) refuseEmptyHandler(T::kName);
      if constexpr (std::is_same_v<Argument, std::span<T>>) setSpanHandler<T>(std::move(handler));
      else setTypedHandler<T, Argument>(std::move(handler));
    }
  }
  // Handles requests until interrupt(), which takes effect between two calls of a handler. Refuses
  // requests of a type that has no handler.
  //   throws  what a handler or the callback of onClient() throws; the other requests wait until
  //           run() is called again; std::logic_error when another thread is in run()
  void run();
  // As run(), until SIGINT or SIGTERM. Returns the exit status of a program: 0.
  int runUntilSignal();
  // Calls one handler, without waiting; returns false when no request waits.
  //   throws  what its handler or the callback of onClient() throws
  bool handleOne();

  // --- operation

  // Sets a callback for a shortage: receive() calls it with the reason and a remedy when this
  // process can accept no more clients because it lacks descriptors, memory or threads, and with
  // an empty text when it can again. Each shortage also counts as an alarm. Set it before the first
  // receive(). It must not throw.
  void onShortage(std::function<void(const std::string& why)> callback);

  // Counts one fault of the hardware that the server drives; `mpf msr` shows the number. Any
  // thread.
  void countAlarm() noexcept;

  // For event loops: poll() the descriptor for reading, then call receive() until it returns an
  // empty handle, which makes the descriptor unreadable until there is something to do again. The
  // server owns the descriptor.
  //   throws  std::logic_error in the child of a fork
  [[nodiscard]] int descriptor();

  // Prints name, queueSize, inQueue, queueRequests, queueFullResponses and replyRequests to stdout
  // (manual, "Diagnostic Aids": msr).
  void report() const;

 private:
  friend class RelayServer;  // internal, for routers
  explicit MessageServer(std::unique_ptr<class ServerCore> core) noexcept;
  [[noreturn]] static void refuseEmptyHandler(std::string_view type);
  template <MessageBody T, class Argument, class Handler>
  void setTypedHandler(Handler handler) {
    setHandler(T::kType, [this, handler = std::move(handler)](Message&& message) mutable {
      if constexpr (std::is_same_v<Argument, T&>) {
        auto* const fields = message.tryAs<T>();
        if (fields == nullptr) return refuse(std::move(message));
        handler(*fields);
        static_cast<void>(reply(std::move(message)));
      } else {
        auto typed = MessageOf<T>::tryFrom(std::move(message));
        if (!typed)
          // NOLINTNEXTLINE(bugprone-use-after-move): tryFrom() has left it unchanged
          return refuse(std::move(message));
        if constexpr (std::is_same_v<Argument, MessageOf<T>&>) {
          handler(*typed);
          static_cast<void>(reply(std::move(*typed)));
        } else {
          handler(std::move(*typed));
        }
      }
    });
  }
  template <ScalarBody T, class Handler>
  void setSpanHandler(Handler handler) {
    setRunHandler(
        T::kType, sizeof(T), &fieldsOf<T>,
        [handler = std::move(handler)](std::span<std::byte> values) mutable {
          handler(std::span(reinterpret_cast<T*>(values.data()), values.size() / sizeof(T)));
        });
  }
  void setHandler(MessageType type, std::function<void(Message&&)> handler);
  // A handler of values of `size` bytes each, which lie one after the other.
  //   fields  returns the value of a request, without a body if the request is invalid
  void setRunHandler(MessageType type, std::size_t size, std::span<std::byte> (*fields)(Message&),
                     std::function<void(std::span<std::byte>)> handler);
  template <ScalarBody T>
  static std::span<std::byte> fieldsOf(Message& request) {
    auto* const value = request.tryAs<T>();
    if (value == nullptr) return {};
    return std::as_writable_bytes(std::span(value, 1));
  }
  void handle(Message&& request);
  // Bodies of `size` bytes each, one after the other.
  RepliedMany replyBodies(const Message& request, MessageType type, std::size_t size,
                          std::span<const std::byte> bodies) noexcept;
  BodyBytes allocate(const Message& request, std::size_t bytes);
  BodyBytes allocateShared(std::size_t bytes);
  static void address(Message& reply, const Message& request) noexcept {
    const auto& route = request.route();
    reply.setRoute({route.link, route.requestId, route.flags, nullptr});
    reply.setClientType(request.getClientType());
    reply.setClientExtra(request.getClientExtra());
  }
  std::unique_ptr<class ServerCore> core_;
};

}  // namespace mpf
