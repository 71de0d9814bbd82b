// SPDX-License-Identifier: MIT
// SyncClient: sends a request to a server and waits for the reply.
//
//   mpf::SyncClient client(backplane, "dac");
//   auto answer = client.call(mpf::Int32Message({.address = 3}), 1s);
//   if (auto reply = answer.as<mpf::Int32>()) use((*reply)->value);
//   else std::cerr << answer.why();
//
// It is a MessageClient with a Dispatcher of its own, which runs only inside the calls below.
//
// Threads  one thread at a time; different threads may make successive calls.
// Crash    as MessageClient: a request to a server that dies gets a fate as its answer.
// Trust    as MessageClient.
// Source   an addition: clients of the manual ("Message Client") receive replies in callbacks only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include <mpf/message_client.h>

namespace mpf {

// The reply to a request, or the reason why it is missing: exactly one of message(), fate() and
// refusal() has a value, until as() moves the reply out.
class Answer {
 public:
  explicit Answer(Message reply) noexcept : reply_(std::move(reply)) {}
  // `details` follow the words "not sent: REFUSAL" or "no reply" in why().
  explicit Answer(SendResult refusal, std::string details = {}) noexcept
      : refusal_(refusal), details_(std::move(details)) {}
  explicit Answer(Fate fate, std::string details = {}) noexcept
      : fate_(fate), details_(std::move(details)) {}

  // True when there is a reply.
  explicit operator bool() const noexcept { return static_cast<bool>(reply_); }
  // The reply, owned by the answer; empty without a reply.
  [[nodiscard]] Message& message() noexcept { return reply_; }
  // Moves the reply out. Returns nullopt, and leaves the reply here, when it is missing or its type
  // is not T.
  template <MessageBody T>
  [[nodiscard]] std::optional<MessageOf<T>> as() {
    auto typed = MessageOf<T>::tryFrom(std::move(reply_));
    if (!typed) expected_ = T::kType;
    return typed;
  }
  // How a request that was sent ended without a reply.
  [[nodiscard]] std::optional<Fate> fate() const noexcept { return fate_; }
  // Why a request was not sent.
  [[nodiscard]] std::optional<SendResult> refusal() const noexcept { return refusal_; }
  // Why there is no reply; after as() has returned nullopt, which type the reply has instead, with
  // its status and text if it is a Char8Array with a status other than 0. Otherwise empty.
  [[nodiscard]] std::string why() const;

 private:
  Message reply_;
  std::optional<Fate> fate_;
  std::optional<SendResult> refusal_;
  std::string details_;
  // The type that as() requested, if the reply has another one.
  MessageType expected_ = MessageType::none;
};

class SyncClient {
 public:
  // Creates a client window in shared memory and binds to the server. call() and connectWait() make
  // the connection; client().notConnectedBecause() returns why it is missing.
  //   throws  std::system_error, for example ENOSPC when /dev/shm is full, EMFILE when the process
  //           has no file descriptor left; std::invalid_argument when `server` is not a valid name
  SyncClient(const Backplane& backplane, const std::string& server,
             std::int32_t location = Backplane::defaultLocation(),
             WaitMode waitMode = WaitMode::adaptive);

  // Waits for the connection if necessary, sends `message` and waits for its first reply. `timeout`
  // limits all three together. After it, the answer is a refusal if the request was not sent, else
  // a fate: `expired` when the server had not taken the request, `outcomeUnknown` when it had.
  //   message   unchanged when it was not sent
  //   retry     as MessageClient::send(): with neverTaken, the request goes to the next server of
  //             the name, until `timeout`
  Answer call(Message&& message, Nanoseconds timeout, Retry retry = Retry::never);
  // Waits for a message that is not the first reply to a call: a further reply, for example of a
  // subscription, or an OutOfBand message. call() stores such messages until receive() returns
  // them, in their order: at most kMaxStored of them, and kMaxStoredLong with a body of more than
  // 192 bytes, which stays in the memory that the server has for this client. It drops the oldest
  // ones above these limits. Returns an empty handle after `timeout`.
  Message receive(Nanoseconds timeout);
  static constexpr std::size_t kMaxStored = 16384;
  static constexpr std::size_t kMaxStoredLong = 64;
  // Number of messages that were dropped since the client was created.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

  // Waits until the client is connected; returns false after `timeout`.
  [[nodiscard]] bool connectWait(Nanoseconds timeout);
  // The client inside, for isConnected(), alloc() and cancel(). Do not bind it.
  [[nodiscard]] MessageClient& client() noexcept { return client_; }

 private:
  SendResult send(Message&& message, Deadline deadline, Retry retry);
  void take(Message&& message);
  void store(Message&& message);
  Message takeStored() noexcept;
  [[nodiscard]] std::string detailsOf(SendResult refusal, const Message& notSent) const;
  Dispatcher dispatcher_;
  MessageClient client_;
  std::uint32_t awaited_ = 0;
  std::optional<Answer> answer_;
  std::deque<Message> others_;
  std::size_t longOthers_ = 0;  // of others_, those with a long body
  std::uint64_t dropped_ = 0;
};

}  // namespace mpf
