// SPDX-License-Identifier: MIT
// SyncClient: asks a server and waits for the answer.
//
//   mpf::SyncClient client(backplane, "dac");
//   auto answer = client.call(mpf::Int32Message({.address = 3}), 1s);
//   if (!answer) std::cerr << answer.why();
//
// Threads  one at a time; another thread may take over between two calls.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include <mpf/message_client.h>

namespace mpf {

// A reply, or why there is none.
class Answer {
 public:
  explicit Answer(Message reply) noexcept : reply_(std::move(reply)) {}
  // `details` follow the refusal when it is put in words.
  explicit Answer(SendResult refusal, std::string details = {}) noexcept
      : refusal_(refusal), details_(std::move(details)) {}
  explicit Answer(Fate fate) noexcept : fate_(fate) {}

  explicit operator bool() const noexcept { return static_cast<bool>(reply_); }
  [[nodiscard]] Message& message() noexcept { return reply_; }
  // Moves the reply out as a T; nullopt when it is of another type.
  template <MessageBody T>
  [[nodiscard]] std::optional<MessageOf<T>> as() {
    return MessageOf<T>::tryFrom(std::move(reply_));
  }
  // Of a request that was accepted and got no reply.
  [[nodiscard]] std::optional<Fate> fate() const noexcept { return fate_; }
  // Of a request that was not accepted.
  [[nodiscard]] std::optional<SendResult> refusal() const noexcept { return refusal_; }
  // In words; empty when there is a reply.
  [[nodiscard]] std::string why() const;

 private:
  Message reply_;
  std::optional<Fate> fate_;
  std::optional<SendResult> refusal_;
  std::string details_;
};

class SyncClient {
 public:
  // Creates a client window in shared memory; the connection comes later, see
  // client().notConnectedBecause().
  //   throws  std::system_error: ENOSPC when /dev/shm is full, EMFILE when no descriptor is left,
  //           ...; std::invalid_argument when `server` cannot be a name
  SyncClient(const Backplane& backplane, const std::string& server,
             std::int32_t location = Backplane::defaultLocation(),
             WaitMode waitMode = WaitMode::adaptive);

  // Sends `message` (waiting for the connection first, if need be) and waits for the first reply.
  // After `timeout` the answer is a fate: `expired` when the server had not taken the request,
  // `outcomeUnknown` when it had.
  Answer call(Message&& message, Nanoseconds timeout);
  // Further messages of the server: later replies of a subscription, OutOfBand. Empty after
  // `timeout`.
  Message receive(Nanoseconds timeout);

  // Waits until the server is connected.
  [[nodiscard]] bool connectWait(Nanoseconds timeout);
  [[nodiscard]] MessageClient& client() noexcept { return client_; }

 private:
  void take(Message&& message);
  Dispatcher dispatcher_;
  MessageClient client_;
  std::uint32_t awaited_ = 0;
  std::optional<Answer> answer_;
  std::deque<Message> others_;
};

}  // namespace mpf
