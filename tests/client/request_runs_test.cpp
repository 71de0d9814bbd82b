// SPDX-License-Identifier: MIT
// MessageServer::on() with a handler of several requests.
#include <algorithm>
#include <cstring>
#include <span>
#include <stdexcept>
#include <vector>

#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

class RequestRuns : public ClientTest {
 protected:
  // Starts a server whose handler records the values, and answers with 100 + value.
  void start(ServerOptions options = {}) {
    startServer(options).on<Int32>([this](std::span<Int32> requests) {
      std::vector<std::int32_t> values;
      for (auto& request : requests) {
        values.push_back(request.value);
        request.value += 100;
      }
      runs_.push_back(values);
      if (onCall_) onCall_();
    });
    bind();
  }
  void send(std::int32_t value, Deadline takeBefore = Deadline::never()) {
    Int32Message request({.value = value});
    request.setClientType(10 * value);
    request.setClientExtra(-value);
    ASSERT_EQ(client_.send(std::move(request), takeBefore, &ids_.emplace_back()), SendResult::sent);
  }
  void expectReply(std::int32_t value) {
    const auto reply = next();
    ASSERT_NE(reply.tryAs<Int32>(), nullptr);
    EXPECT_EQ(reply.tryAs<Int32>()->value, 100 + value);
    EXPECT_EQ(reply.getClientType(), 10 * value);
    EXPECT_EQ(reply.getClientExtra(), -value);
    EXPECT_EQ(reply.route().requestId, ids_.at(static_cast<std::size_t>(value)));
    EXPECT_NE(reply.route().flags & kEndsRequest, 0u);
  }

  std::vector<std::vector<std::int32_t>> runs_;
  std::vector<std::uint32_t> ids_;
  std::function<void()> onCall_;
};

TEST_F(RequestRuns, AreAnsweredInOrderWithTheMarksOfEach) {
  start();
  for (std::int32_t i = 0; i < 3; ++i) send(i);

  EXPECT_TRUE(server_->handleOne());

  EXPECT_THAT(runs_, ElementsAre(ElementsAre(0, 1, 2)));
  EXPECT_FALSE(server_->handleOne());
  for (std::int32_t i = 0; i < 3; ++i) expectReply(i);
}

TEST_F(RequestRuns, OfOneRequestAreAnsweredAlike) {
  start();
  send(0);

  EXPECT_TRUE(server_->handleOne());

  EXPECT_THAT(runs_, ElementsAre(ElementsAre(0)));
  expectReply(0);
}

TEST_F(RequestRuns, HaveUpTo16Requests) {
  start();
  for (std::int32_t i = 0; i < 40; ++i) send(i);

  while (server_->handleOne()) {
  }

  std::size_t requests = 0;
  for (const auto& run : runs_) {
    EXPECT_LE(run.size(), 16u);
    requests += run.size();
  }
  EXPECT_EQ(requests, 40u);
  EXPECT_LE(runs_.size(), 4u);
  for (std::int32_t i = 0; i < 40; ++i) expectReply(i);
}

// The server claims the lines of replies in groups, which end within the runs.
TEST_F(RequestRuns, MayBeginAnywhereInTheRing) {
  start();
  std::int32_t sent = 0;
  std::int32_t answered = 0;
  for (int round = 0; round < 30; ++round) {
    for (const auto end = sent + 3 + round % 14; sent < end; ++sent) send(sent);
    while (server_->handleOne()) {
    }
    while (answered < sent) expectReply(answered++);
  }
}

TEST_F(RequestRuns, AreCounted) {
  start();
  for (std::int32_t i = 0; i < 5; ++i) send(i);
  server_->handleOne();
  for (std::int32_t i = 0; i < 5; ++i) expectReply(i);

  // 5 requests at the server, and 5 replies at the client.
  EXPECT_EQ(sumOf(&layout::WindowControl::received), 10u);
  EXPECT_EQ(sumOf(&layout::WindowControl::sent), 5u);
}

TEST_F(RequestRuns, EndAtARequestOfAnotherType) {
  start();
  int others = 0;
  server_->on<OutOfBand>([&](OutOfBand&) { ++others; });
  send(0);
  send(1);
  ASSERT_EQ(client_.send(OutOfBandMessage()), SendResult::sent);
  ids_.emplace_back();
  ids_.emplace_back();
  send(2);

  server_->handleOne();
  EXPECT_THAT(runs_, ElementsAre(ElementsAre(0, 1)));
  server_->handleOne();
  EXPECT_EQ(others, 1);
  while (server_->handleOne()) {
  }
  EXPECT_EQ(runs_.size(), 2u);
  for (int i = 0; i < 4; ++i) next();
}

TEST_F(RequestRuns, EndAtARequestWithADeadline) {
  start();
  send(0);
  send(1);
  send(2, Deadline::after(1h));
  send(3);

  while (server_->handleOne()) {
  }

  EXPECT_THAT(runs_, ElementsAre(ElementsAre(0, 1), ElementsAre(2), ElementsAre(3)));
  for (std::int32_t i = 0; i < 4; ++i) expectReply(i);
}

TEST_F(RequestRuns, DoNotContainAnExpiredRequest) {
  start();
  send(0);
  send(1, Deadline::atNs(1));
  send(2);

  while (server_->handleOne()) {
  }

  EXPECT_THAT(runs_, ElementsAre(ElementsAre(0), ElementsAre(2)));
  std::vector<std::optional<Fate>> fates;
  for (int i = 0; i < 3; ++i) fates.push_back(fateOf(next()));
  EXPECT_THAT(fates, testing::UnorderedElementsAre(std::nullopt, Fate::expired, std::nullopt));
}

TEST_F(RequestRuns, AreRefusedIfTheHandlerThrows) {
  start();
  for (std::int32_t i = 0; i < 3; ++i) send(i);
  onCall_ = [] { throw std::runtime_error("the handler throws"); };

  EXPECT_THROW(server_->handleOne(), std::runtime_error);
  onCall_ = nullptr;
  send(3);
  send(4);
  server_->handleOne();

  for (int i = 0; i < 3; ++i) EXPECT_EQ(fateOf(next()), Fate::refused);
  expectReply(3);
  expectReply(4);
}

TEST_F(RequestRuns, MayNest) {
  start();
  for (std::int32_t i = 0; i < 3; ++i) send(i);
  int depth = 0;
  onCall_ = [&] {
    if (++depth > 1) return;
    send(3);
    send(4);
    EXPECT_TRUE(server_->handleOne());
  };

  server_->handleOne();

  EXPECT_THAT(runs_, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(3, 4)));
  for (const auto i : {3, 4, 0, 1, 2}) expectReply(i);
}

// The next client gets the same connection object, and uses the same request numbers.
TEST_F(RequestRuns, AreNotAnsweredToTheNextClient) {
  start();
  std::vector<std::int32_t> answers;
  const auto count = [&](const Message& message) {
    if (const auto* value = message.tryAs<Int32>()) answers.push_back(value->value);
  };
  auto first = std::make_unique<MessageClient>(dispatcher_, count);
  MessageClient second(dispatcher_, count);
  std::vector<Message> held;
  const auto receiveUntil = [&](const auto& condition) {
    while (!condition()) {
      if (auto request = server_->receive()) held.push_back(std::move(request));
      dispatcher_.runOnce(Deadline::after(100us));
    }
  };
  first->bind("device[0]/a");
  receiveUntil([&] { return first->isConnected(); });
  ASSERT_EQ(first->send(Int32Message()), SendResult::sent);
  receiveUntil([&] { return held.size() == 1; });
  for (int i = 0; i < 3; ++i) ASSERT_EQ(first->send(Int32Message()), SendResult::sent);
  onCall_ = [&] {
    const auto client = server_->clientOf(held.at(0));
    first.reset();
    receiveUntil([&] { return server_->clientOf(held.at(0)) != client; });
    held.clear();
    second.bind("device[0]/a");
    receiveUntil([&] { return second.isConnected(); });
    for (int i = 0; i < 4; ++i) EXPECT_EQ(second.send(Int32Message()), SendResult::sent);
    receiveUntil([&] { return held.size() == 4; });
  };

  server_->handleOne();

  EXPECT_THAT(runs_, ElementsAre(ElementsAre(0, 0, 0)));
  for (auto& request : held) EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  receiveUntil([&] { return answers.size() == 4; });
  EXPECT_THAT(answers, ElementsAre(0, 0, 0, 0)) << "100 is the answer to a request of the first";
}

TEST_F(RequestRuns, OfABusyClientDoNotDelayAnotherForLong) {
  start();
  MessageClient quiet(dispatcher_, [](const Message&) {});
  quiet.bind("device[0]/a");
  runUntil([&] { return quiet.isConnected(); });
  const std::vector<Int32> many(60);
  // Handles one run; the busy client has always sent more.
  const auto handleRun = [&] {
    static_cast<void>(client_.sendMany<Int32>(many));
    runs_.clear();
    server_->handleOne();
    dispatcher_.runOnce(Deadline::atNs(0));
    messages_.clear();
  };
  const std::vector<std::int32_t> ofQuiet{-1};
  std::size_t most = 0;
  for (int round = 0; round < 16; ++round) {
    for (int i = 0; i < 5000 + round; ++i) handleRun();  // then the quiet client is not polled
    ASSERT_EQ(quiet.send(Int32Message({.value = -1})), SendResult::sent);
    std::size_t before = 0;
    for (handleRun(); runs_.at(0) != ofQuiet; handleRun()) before += runs_.at(0).size();
    most = std::max(most, before);
  }

  EXPECT_LE(most, 64u);
  runUntil([&] { return !server_->handleOne(); });
  messages_.clear();
}

TEST_F(RequestRuns, HaveTheTimeOfTheirSendingIfTheServerStampsReplies) {
  start({.stampsReplies = true});
  const auto before = Clock::wallNs();
  for (std::int32_t i = 0; i < 3; ++i) send(i);
  server_->handleOne();
  const auto after = Clock::wallNs();

  for (std::int32_t i = 0; i < 3; ++i) {
    const auto reply = next();
    EXPECT_GE(reply.getTimeStampNs(), before);
    EXPECT_LE(reply.getTimeStampNs(), after);
  }
}

TEST_F(RequestRuns, EndWithAnotherHandler) {
  start();
  for (std::int32_t i = 0; i < 2; ++i) send(i);
  int calls = 0;
  server_->on<Int32>([&](Int32& request) {
    request.value += 100;
    ++calls;
  });

  while (server_->handleOne()) {
  }

  EXPECT_EQ(calls, 2);
  EXPECT_THAT(runs_, testing::IsEmpty());
  expectReply(0);
  expectReply(1);
}

TEST_F(RequestRuns, MayReplaceTheirHandler) {
  startServer();
  const auto calls = std::make_shared<std::vector<std::size_t>>();
  server_->on<Int32>([this, calls](std::span<Int32> requests) {
    server_->on<Int32>([](Int32& request) { request.value = 7; });
    for (auto& request : requests) request.value += 100;
    calls->push_back(requests.size());
  });
  bind();
  send(0);
  send(1);

  server_->handleOne();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  server_->handleOne();

  EXPECT_THAT(*calls, ElementsAre(2));
  expectReply(0);
  expectReply(1);
  EXPECT_EQ(next().tryAs<Int32>()->value, 7);
}

TEST_F(RequestRuns, AreNotForHandlersThatTakeOneRequestOrSeveral) {
  startServer();
  bind();
  const auto answer = [&] {
    EXPECT_EQ(client_.send(Int32Message({.value = 1})), SendResult::sent);
    while (server_->handleOne()) {
    }
    return next().tryAs<Int32>()->value;
  };

  server_->on<Int32>([](auto& request) { request.value += 1; });
  EXPECT_EQ(answer(), 2);
  server_->on<Int32>([](auto&& request) { request.value += 2; });
  EXPECT_EQ(answer(), 3);
  std::int32_t seen = 0;
  server_->on<Int32>([&](const auto& request) { seen = request.value; });
  EXPECT_EQ(answer(), 1);
  EXPECT_EQ(seen, 1);
}

// Such a body is a valid Int32 in shared memory, which the client may change.
TEST_F(RequestRuns, AreCopiesOfALongerBody) {
  start();
  std::vector<std::byte> longer(1000);
  const Int32 fields{.value = 5};
  std::memcpy(longer.data(), &fields, sizeof fields);
  ASSERT_EQ(client_.send(Message::copyOf(MessageType::int32, longer)), SendResult::sent);

  server_->handleOne();

  EXPECT_THAT(runs_, ElementsAre(ElementsAre(5)));
  const auto reply = next();
  EXPECT_EQ(reply.tryAs<Int32>()->value, 105);
  EXPECT_EQ(reply.body().size(), 1000u);
}

TEST_F(RequestRuns, AreNotReceivedTogetherWithoutAHandler) {
  start();
  for (std::int32_t i = 0; i < 2; ++i) send(i);

  auto request = server_->receive();
  ASSERT_TRUE(request);
  request.tryAs<Int32>()->value += 100;
  EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  while (server_->handleOne()) {
  }

  EXPECT_THAT(runs_, ElementsAre(ElementsAre(1)));
  expectReply(0);
  expectReply(1);
}

TEST_F(RequestRuns, OfLongerValuesHaveOneRequestEach) {
  std::vector<std::size_t> sizes;
  startServer().on<Float64>([&](std::span<Float64> requests) {
    sizes.push_back(requests.size());
    for (auto& request : requests) request.value *= 2;
  });
  bind();
  for (int i = 0; i < 2; ++i)
    ASSERT_EQ(client_.send(Float64Message({.value = 1.0 + i})), SendResult::sent);

  while (server_->handleOne()) {
  }

  EXPECT_THAT(sizes, ElementsAre(1, 1));
  EXPECT_EQ(next().tryAs<Float64>()->value, 2.0);
  EXPECT_EQ(next().tryAs<Float64>()->value, 4.0);
}

TEST_F(RequestRuns, AreTakenByRun) {
  start();
  for (std::int32_t i = 0; i < 3; ++i) send(i);
  onCall_ = [&] { server_->interrupt(); };

  server_->run();

  EXPECT_THAT(runs_, ElementsAre(ElementsAre(0, 1, 2)));
  for (std::int32_t i = 0; i < 3; ++i) expectReply(i);
}

}  // namespace
}  // namespace mpf::test
