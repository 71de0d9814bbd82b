// SPDX-License-Identifier: MIT
// A server that sends messages that only MPF may send: its client ends the connection.
#include <array>
#include <cstring>

#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

class ProtocolErrorTest : public ClientTest {
 protected:
  // Sends a request to the server, whose reply must end the connection.
  void expectToBeLeft() {
    bind();
    ASSERT_EQ(client_.send(Int32Message({.value = 1})), SendResult::sent);

    runUntil([&] { return news_.size() == 2; });

    EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo));
    EXPECT_EQ(client_.notConnectedBecause(), "the server sent invalid data");
    EXPECT_EQ(fateOf(next()), Fate::outcomeUnknown);
  }
};

TEST_F(ProtocolErrorTest, AServerMustNotSendConnectMessages) {
  auto& server = startServer();
  server.on<Int32>([&](Int32Message&& request) {
    auto lie = server.allocReplyMessage<Connect>(request);
    lie->status = ConnectStatus::connectNo;
    static_cast<void>(server.reply(std::move(lie)));
  });

  expectToBeLeft();
}

// Whatever is in it.
TEST_F(ProtocolErrorTest, AServerMustNotSendConnectMessagesThatAreTooShort) {
  auto& server = startServer();
  server.on<Int32>([&](Int32Message&& request) {
    auto lie = Message::copyOf(MessageType::connect, std::array{std::byte{1}});
    lie.setRoute(request.route());
    static_cast<void>(server.reply(std::move(lie)));
  });

  expectToBeLeft();
}

TEST_F(ProtocolErrorTest, AFateOfAnotherRequestEndsNoRequest) {
  auto& server = startServer();
  server.on<Int32>([&](Int32Message&& request) {
    auto lie = server.allocReplyMessage<RequestFate>(request);
    lie->fate = Fate::cancelled;
    lie->requestId = 77;
    static_cast<void>(server.reply(std::move(lie)));
  });

  expectToBeLeft();
}

// A server could change a long body, which is in shared memory, after the client has checked it.
TEST_F(ProtocolErrorTest, AFateInSharedMemoryEndsNoRequest) {
  auto& server = startServer();
  server.on<Int32>([&](Int32Message&& request) {
    const RequestFate fate{.fate = Fate::refused, .requestId = request.route().requestId};
    std::array<std::byte, 1000> body{};
    std::memcpy(body.data(), &fate, sizeof fate);
    auto lie = Message::copyOf(MessageType::requestFate, body);
    lie.setRoute(request.route());
    static_cast<void>(server.reply(std::move(lie)));
  });
  bind();
  ASSERT_EQ(client_.send(Int32Message({.value = 1})), SendResult::sent);

  EXPECT_EQ(fateOf(next()), Fate::outcomeUnknown);

  EXPECT_EQ(client_.notConnectedBecause(), "the server sent invalid data");
}

TEST_F(ProtocolErrorTest, AFateAfterTheReplyEndsNothing) {
  auto& server = startServer();
  server.on<Int32>([&](Int32Message&& request) {
    auto lie = server.allocReplyMessage<RequestFate>(request);
    static_cast<void>(server.reply(std::move(request)));
    static_cast<void>(server.reply(std::move(lie)));
  });
  bind();
  ASSERT_EQ(client_.send(Int32Message({.value = 1})), SendResult::sent);

  runUntil([&] { return news_.size() == 2; });

  EXPECT_TRUE(next().tryAs<Int32>());
  EXPECT_EQ(client_.notConnectedBecause(), "the server sent invalid data");
}

}  // namespace
}  // namespace mpf::test
