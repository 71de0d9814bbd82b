// SPDX-License-Identifier: MIT
// Caller: a client that records all messages that it receives, in order. Checks that each request
// ends exactly once, before the disconnect.
//
// Threads  one: the thread of its dispatcher.
#pragma once

#include <deque>
#include <gtest/gtest.h>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <mpf/message_client.h>

#include "client/relay_client.h"

namespace mpf::test {

class Caller {
 public:
  explicit Caller(Dispatcher& dispatcher, const std::string& server = "echo",
                  std::int32_t location = 1)
      : client(dispatcher, [this](Message&& message) { note(std::move(message)); }) {
    client.bind(server, location);
  }
  // Returns the id of the request; 0 if it was not sent.
  std::uint32_t send(Message&& message, Deadline takeBefore = Deadline::never()) {
    std::uint32_t id = 0;
    EXPECT_EQ(client.send(std::move(message), takeBefore, &id), SendResult::sent);
    const bool isNew = id == 0 || open.insert(id).second;
    EXPECT_TRUE(isNew) << "the id of an open request was used again";
    return id;
  }
  [[nodiscard]] bool isConnected() const { return client.isConnected(); }
  // The next message that is not a ConnectMessage; empty if there is no such message.
  Message take() {
    if (messages.empty()) return {};
    auto message = std::move(messages.front());
    messages.pop_front();
    return message;
  }

  std::vector<ConnectStatus> news;
  std::deque<Message> messages;
  std::set<std::uint32_t> open;  // requests that have not ended
  MessageClient client;

 private:
  void note(Message&& message) {
    if (const auto* connect = message.tryAs<Connect>()) {
      news.push_back(connect->status);
      EXPECT_TRUE(connect->status != ConnectStatus::connectNo || open.empty())
          << "a disconnect before the end of all requests";
      return;
    }
    const bool isSound =
        !RelayClient::endsRequest(message) || open.erase(message.route().requestId) == 1;
    EXPECT_TRUE(isSound) << "a request that is not open has ended";
    messages.push_back(std::move(message));
  }
};

inline std::optional<Fate> fateOf(const Message& message) {
  const auto* fate = message.tryAs<RequestFate>();
  return fate != nullptr ? std::optional(fate->fate) : std::nullopt;
}

}  // namespace mpf::test
