// SPDX-License-Identifier: MIT
// ClientTest: a server and a client that take turns in one thread.
#pragma once

#include <chrono>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <vector>

#include <mpf/client/sync_client.h>
#include <mpf/server/message_server.h>
#include <mpf/tests/support/watchdog.h>

namespace mpf::test {

using namespace std::chrono_literals;

class ClientTest : public testing::Test {
 protected:
  MessageServer& startServer(ServerOptions options = {}) {
    server_ = std::make_unique<MessageServer>(backplane_, "device[0]/a", options);
    return *server_;
  }
  void bind() {
    client_.bind("device[0]/a");
    if (server_) runUntil([&] { return client_.isConnected(); });
  }
  template <class Condition>
  void runUntil(Condition condition) {
    while (!condition()) {
      if (server_ && serverRuns_) server_->handleOne();
      dispatcher_.runOnce(Deadline::after(100us));
    }
  }
  // The next message that is no ConnectMessage.
  Message next() {
    runUntil([&] { return !messages_.empty(); });
    auto message = std::move(messages_.front());
    messages_.erase(messages_.begin());
    return message;
  }
  void TearDown() override {
    EXPECT_THAT(messages_, testing::IsEmpty());
    server_.reset();
  }

  Watchdog watchdog_{"client test"};
  Backplane backplane_ = Backplane::isolated();
  std::unique_ptr<MessageServer> server_;
  bool serverRuns_ = true;
  std::vector<Message> messages_;
  std::vector<ConnectStatus> news_;
  Dispatcher dispatcher_{backplane_};
  MessageClient client_{dispatcher_, [this](Message message) {
                          if (const auto* connect = message.tryAs<Connect>()) {
                            news_.push_back(connect->status);
                          } else {
                            messages_.push_back(std::move(message));
                          }
                        }};
};
inline std::optional<Fate> fateOf(const Message& message) {
  const auto* fate = message.tryAs<RequestFate>();
  return fate != nullptr ? std::optional(fate->fate) : std::nullopt;
}
}  // namespace mpf::test
