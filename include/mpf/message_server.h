// SPDX-License-Identifier: MIT
// MessageServer: a named server on a backplane (manual, "Message Server").
//
//   mpf::MessageServer server(mpf::Backplane::attach(), "dac");
//   server.on<mpf::Int32>([&](mpf::Int32& request) { request.status =
//   dac.trySetCounts(request.address, request.value) ? 0 : -1; }); return server.runUntilSignal();
//
// or by hand, with replies now or later, one or many:
//
//   while (server.waitForMessage()) {
//     while (mpf::Message request = server.receive()) { ...; server.reply(std::move(request)); }
//   }
//
// Threads  one thread waits and receives; reply(), allocReplyMessage() and interrupt() may be
//          called by any.
// Crash    a client that dies takes nothing along; what this server held of it goes when the
//          handles go.
// Trust    a client that writes nonsense loses its link; nobody else notices.
// Throws   an exception that leaves a handler leaves run(), runUntilSignal() or handleOne(); the
//          request, if it has had no reply, ends as `refused`. One that leaves the callback of
//          onClient() leaves receive(). Everything else is intact, and the next call continues with
//          what is left. Clients follow the same rule: see Dispatcher.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <mpf/backplane.h>
#include <mpf/clock.h>
#include <mpf/message_of.h>
#include <mpf/rights.h>
#include <mpf/wait_mode.h>

namespace mpf {

struct ServerOptions {
  std::int32_t location = Backplane::defaultLocation();
  int queueSize = 100;  // requests of one client that may wait; 1 to 16384
  std::uint64_t maxMessageBytes = 64ull << 20;  // largest body, either way
  // shared memory for large messages of one client, each way
  std::uint64_t maxPoolBytes = 320ull << 20;
  WaitMode waitMode = WaitMode::adaptive;
  Rights rights{};  // who may bind: mode 0660 and a group let its members in
};

// What became of a reply.
enum class ReplyResult { sent, clientGone, queueFull, tooLarge, noMemory };
[[nodiscard]] const char* toString(ReplyResult result) noexcept;

class MessageServer {
 public:
  // Opens the server under `name` at once; requests wait until somebody receives them.
  //   throws  NameInUse when another process serves that name at that location, SegmentError when
  //           something foreign is in its place, std::invalid_argument for a name or an option that
  //           cannot be, std::system_error: ENOSPC when /dev/shm is full, EMFILE when no descriptor
  //           is left, ...
  MessageServer(const Backplane& backplane, const std::string& name,
                const ServerOptions& options = {});
  ~MessageServer();
  MessageServer(const MessageServer&) = delete;
  MessageServer& operator=(const MessageServer&) = delete;

  [[nodiscard]] const std::string& getName() const noexcept;
  [[nodiscard]] std::int32_t location() const noexcept;
  // For clients that connect from now on.
  //   throws  std::invalid_argument outside 1 to 16384
  void setQueueSize(int size);

  // Waits for a request. False: the deadline passed, or interrupt() was called.
  bool waitForMessage(Deadline deadline = Deadline::never());
  // The next request; empty when there is none. A request whose deadline has passed ends as
  // `expired` and is not seen here. A request that is neither replied to nor kept ends as `refused`
  // when its handle dies.
  Message receive();
  // Ends waitForMessage() or run(), now or the next time; requests that wait stay where they are.
  // Async-signal-safe.
  void interrupt() noexcept;
  // Names the client that `request` came from, as long as it is connected; 0 when it is gone. No
  // two connections have the same name.
  [[nodiscard]] std::uint64_t clientOf(const Message& request) const noexcept;
  // Whether that client is still there: false once it has died or disconnected. For any thread, and
  // during a handler: clientOf() names a client until this server's thread looks around again.
  [[nodiscard]] bool isAwaited(const Message& request) const noexcept;

  // A reply to `request`, which must still exist: to be sent once, before or after the request
  // itself is replied with.
  template <ScalarBody T>
  [[nodiscard]] MessageOf<T> allocReplyMessage(const Message& request) {
    MessageOf<T> message;
    address(message, request);
    return message;
  }
  // The same for n elements, in the memory that is shared with the client. Throws std::bad_alloc.
  template <ArrayBody T>
  [[nodiscard]] MessageOf<T> allocReplyMessage(const Message& request, std::size_t n) {
    auto message = MessageOf<T>::inBuffer(allocate(request, MessageOf<T>::bytesFor(n)), n);
    address(message, request);
    return message;
  }
  // Sends `message` to the client that its request came from, and empties it; if it was not sent,
  // it is as it was. The first reply ends the request; further ones are refused with queueFull
  // while the client does not take them.
  ReplyResult reply(Message&& message);
  // Ends a request without a reply: its client gets the fate `refused`.
  void refuse(Message&& request);

  // Handles each request of type T in run(). A handler of T& (its fields) or MessageOf<T>& (its
  // elements, too) changes the request, which is the reply; one of MessageOf<T>&& owns the request.
  template <MessageBody T, class Handler>
  void on(Handler handler) {
    setHandler(T::kType, [this, handler = std::move(handler)](Message&& message) mutable {
      auto typed = MessageOf<T>::tryFrom(std::move(message));
      if (!typed)
        return refuse(std::move(message));  // NOLINT(bugprone-use-after-move): then it is as it was
      if constexpr (std::is_invocable_v<Handler&, T&>) {
        handler(**typed);
        static_cast<void>(reply(std::move(*typed)));
      } else if constexpr (std::is_invocable_v<Handler&, MessageOf<T>&>) {
        handler(*typed);
        static_cast<void>(reply(std::move(*typed)));
      } else {
        handler(std::move(*typed));
      }
    });
  }
  // Handles requests until interrupt(), which takes effect between two requests. Types without a
  // handler are refused.
  //   throws  what a handler throws; requests wait until run() is called again
  void run();
  // As run(), until SIGINT or SIGTERM. Returns the exit status of a program: 0.
  int runUntilSignal();
  // Handles one request if there is one. Throws what its handler throws.
  bool handleOne();

  // --- for routers, who serve in the name of others
  // `news(client, true)` when a client has connected, `news(client, false)` when it is gone; from
  // within receive() and waitForMessage(). Once, before the first of them. What it throws,
  // receive() throws after it has brought its links in order.
  void onClient(std::function<void(std::uint64_t client, bool isThere)> news);
  // By when the request received last shall be taken.
  [[nodiscard]] Deadline takeBefore() const noexcept;
  // As reply(), to a request whose handle is gone: that of clientOf(request) and
  // request.route().requestId.
  ReplyResult replyTo(std::uint64_t client, std::uint32_t requestId, Message&& message);
  // Whether that request has had no reply yet.
  [[nodiscard]] bool owes(std::uint64_t client, std::uint32_t requestId) const noexcept;
  // The requests of a client that were received and have had no reply yet.
  [[nodiscard]] std::vector<std::uint32_t> owed(std::uint64_t client) const;
  // Memory to build the body of a reply to one in. Throws std::bad_alloc.
  [[nodiscard]] BodyBytes allocateBody(std::uint64_t client, std::size_t bytes);

  // Calls `tell` with the reason when no more clients can be accepted because this process lacks
  // file descriptors or memory, and with an empty text once they can be: once each, from within
  // receive() and waitForMessage(). An alarm is counted with or without it. Before the first of
  // them.
  void onShortage(std::function<void(const std::string& why)> tell);

  // For servers that drive hardware: one more of its faults, for `mpf msr`. Any thread.
  void countAlarm() noexcept;

  // For event loops: poll() the descriptor for reading, then receive() until empty, which arms it
  // again.
  [[nodiscard]] int descriptor();

  // The manual's `msr`, to stdout.
  void report() const;

 private:
  class Impl;
  void setHandler(MessageType type, std::function<void(Message&&)> handler);
  void callHandler(const std::function<void(Message&&)>& handler, Message&& request);
  BodyBytes allocate(const Message& request, std::size_t bytes);
  static void address(Message& reply, const Message& request) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mpf
