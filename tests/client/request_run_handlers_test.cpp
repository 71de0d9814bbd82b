// SPDX-License-Identifier: MIT
// MessageServer::on() with a handler of several requests: what the handler may do.
#include <algorithm>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include "tests/client/request_runs_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

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

// A handler of single requests, and one of several for which only one request waits.
TEST_F(RequestRuns, OfOneMayReplaceTheirHandler) {
  startServer();
  bind();
  const auto owned = std::make_shared<int>();
  std::vector<long> owners;
  const auto replace = [&] {
    server_->on<Int32>([](Int32& request) { request.value = 7; });
    owners.push_back(owned.use_count());
  };
  const auto answer = [&] {
    send(0);
    server_->handleOne();
    const auto reply = next();
    return reply.tryAs<Int32>()->value;
  };

  server_->on<Int32>([&, owned](Int32&) { replace(); });
  EXPECT_EQ(answer(), 0);
  EXPECT_EQ(answer(), 7);
  server_->on<Int32>([&, owned](std::span<Int32>) { replace(); });
  EXPECT_EQ(answer(), 0);
  EXPECT_EQ(answer(), 7);

  EXPECT_THAT(owners, ElementsAre(2, 2)) << "a handler was destroyed while it was running";
}

// The requests that a handler keeps end before their server.
TEST_F(RequestRuns, ThatAHandlerKeepsAreRefusedWhenTheServerEnds) {
  startServer().on<Int32>([kept = std::make_shared<std::vector<Message>>()](
                              Int32Message&& request) { kept->push_back(std::move(request)); });
  bind();
  send(0);
  server_->handleOne();

  server_.reset();

  EXPECT_EQ(fateOf(next()), Fate::refused);
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
