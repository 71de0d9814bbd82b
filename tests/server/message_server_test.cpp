// SPDX-License-Identifier: MIT
// MessageServer: arguments that it refuses, and what it learns of clients that come and go. The
// tests of clients show how it serves them.
#include <mpf/message_server.h>

#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <mpf/message_client.h>

#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

TEST(MessageServerTest, AReplyWithMoreElementsThanALengthCanCountIsAnError) {
  const TestBackplane backplane;
  MessageServer server(backplane, "server");

  for (const std::size_t n : {std::size_t{1} << 32, std::size_t{1} << 61, SIZE_MAX}) {
    EXPECT_THROW(static_cast<void>(server.allocReplyMessage<Float64Array>(Message(), n)),
                 std::length_error);
  }
}

TEST(MessageServerTest, AnInvalidNameOrQueueSizeIsAnError) {
  const TestBackplane backplane;

  EXPECT_THROW(MessageServer(backplane, ""), std::invalid_argument);
  EXPECT_THROW(MessageServer(backplane, "server", {.queueSize = 0}), std::invalid_argument);
}

TEST(MessageServerTest, InvalidRightsAreAnError) {
  const TestBackplane backplane;

  EXPECT_THROW(MessageServer(backplane, "server", {.rights = {.mode = 0}}), std::invalid_argument);
}

TEST(MessageServerTest, AnEmptyHandlerIsAnError) {
  const TestBackplane backplane;
  MessageServer server(backplane, "server");

  EXPECT_THROW(server.on<Int32>(std::function<void(Int32&)>()), std::invalid_argument);
  EXPECT_THROW(server.on<Int32>(std::function<void(std::span<Int32>)>()), std::invalid_argument);
  EXPECT_THROW(server.on<Int32Array>(static_cast<void (*)(Int32ArrayMessage&)>(nullptr)),
               std::invalid_argument);
}

TEST(MessageServerTest, AReplyWithoutARequestIsNotSent) {
  const TestBackplane backplane;
  MessageServer server(backplane, "server");
  auto reply = server.allocReplyMessage<Int32>(Message());

  EXPECT_EQ(server.reply(std::move(reply)), ReplyResult::clientGone);
}

// A server and clients that take turns in one thread.
class ClientsOfServerTest : public testing::Test {
 protected:
  std::unique_ptr<MessageClient> connect() {
    auto client = std::make_unique<MessageClient>(dispatcher_, [this](Message&& message) {
      if (message.tryAs<Connect>() == nullptr) ends_.push_back(std::move(message));
    });
    client->bind("server");
    while (!client->isConnected()) takeTurns();
    return client;
  }
  void takeTurns() {
    server_.handleOne();
    dispatcher_.runOnce(Deadline::after(std::chrono::microseconds(100)));
  }

  Watchdog watchdog_{"clients of a server"};
  TestBackplane backplane_;
  Dispatcher dispatcher_{backplane_};
  MessageServer server_{backplane_, "server"};
  std::vector<Message> ends_;  // replies and fates
};

TEST_F(ClientsOfServerTest, AreReportedBeforeTheirFirstRequestAndAfterTheirLast) {
  std::vector<std::pair<std::uint64_t, bool>> changes;
  std::vector<std::size_t> changesBeforeRequest;
  std::uint64_t client = 0;
  server_.onClient(
      [&](std::uint64_t number, bool isConnected) { changes.emplace_back(number, isConnected); });
  server_.on<Int32>([&](Int32Message&& request) {
    client = server_.clientOf(request);
    changesBeforeRequest.push_back(changes.size());
  });
  auto first = connect();

  for (int i = 0; i < 3; ++i) ASSERT_EQ(first->send(Int32Message()), SendResult::sent);
  first.reset();
  while (changes.size() != 2) takeTurns();

  EXPECT_THAT(changesBeforeRequest, testing::ElementsAre(1u, 1u, 1u));
  EXPECT_THAT(changes, testing::ElementsAre(std::pair(client, true), std::pair(client, false)));
}

TEST_F(ClientsOfServerTest, AReplyToACancelledRequestIsSentAndDropped) {
  Int32Message held;
  server_.on<Int32>([&](Int32Message&& request) { held = std::move(request); });
  const auto client = connect();
  std::uint32_t id = 0;
  ASSERT_EQ(client->send(Int32Message(), Deadline::never(), &id), SendResult::sent);
  while (!held) takeTurns();
  client->cancel(id);
  while (ends_.empty()) takeTurns();

  const bool isConnected = server_.isClientConnected(held);
  const auto result = server_.reply(std::move(held));

  EXPECT_TRUE(isConnected);
  EXPECT_EQ(result, ReplyResult::sent);
  ASSERT_EQ(client->send(Int32Message({.value = 7})), SendResult::sent);
  while (!held) takeTurns();
  EXPECT_EQ(server_.reply(std::move(held)), ReplyResult::sent);
  while (ends_.size() != 2) takeTurns();
  EXPECT_EQ(ends_[0].tryAs<RequestFate>()->fate, Fate::cancelled);
  EXPECT_EQ(ends_[1].tryAs<Int32>()->value, 7) << "the reply to the cancelled request";
}

}  // namespace
}  // namespace mpf::test
