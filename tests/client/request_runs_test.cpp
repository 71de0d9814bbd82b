// SPDX-License-Identifier: MIT
// MessageServer::on() with a handler of several requests: which requests it gets together.
#include <cstring>
#include <span>
#include <vector>

#include "tests/client/request_runs_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

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

}  // namespace
}  // namespace mpf::test
