// SPDX-License-Identifier: MIT
// A client router has connected to a rogue. A violation of the protocol ends the rogue's
// connection, so that the requests of its clients end. Other clients are not affected.
#include "tests/router/rogue/rogue_server.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(RogueServerTest, ServesWhileItFollowsTheProtocol) {
  auto peer = rogue();
  for (int i = 0; i < 3; ++i) {
    const auto id = asked(peer);
    peer.sendItems({reply(client_, id, true, i), reply(client_, id, false, 100 + i)});
    EXPECT_EQ(nextValue(), i);
    EXPECT_EQ(nextValue(), 100 + i);
  }
}

TEST_F(RogueServerTest, ThatDoesNotGreetIsCutAndConnectedToAgain) {
  for (int i = 0; i < 3; ++i) {
    auto peer = host_.accept();
    peer.sendItems({server(1, wire::Server::State::THERE)});
    EXPECT_THAT(peer.farewell(),
                AllOf(HasSubstr("code = protocol"), HasSubstr("is not a greeting")));
  }
  auto peer = rogue();
  const auto id = asked(peer);
  peer.sendItems({reply(client_, id, true, 5)});
  EXPECT_EQ(nextValue(), 5);
}

// ---- invalid replies

TEST_F(RogueServerTest, AReplyToAnUnknownRequestIsCut) {
  expectFarewell([](auto client, auto id) { return std::vector{reply(client, id + 1, true)}; },
                 AllOf(HasSubstr("code = protocol"), HasSubstr("is not pending")));
  EXPECT_THAT(fates(), ElementsAre(Fate::outcomeUnknown));
}

TEST_F(RogueServerTest, ASecondFirstReplyIsCut) {
  expectFarewell(
      [](auto client, auto id) {
        return std::vector{reply(client, id, true, 8), reply(client, id, true, 9)};
      },
      AllOf(HasSubstr("code = protocol"), HasSubstr("is not pending")));
  EXPECT_EQ(nextValue(), 8);
  EXPECT_THAT(caller_->messages, IsEmpty());
}

TEST_F(RogueServerTest, ALaterReplyBeforeTheFirstIsCut) {
  expectFarewell([](auto client, auto id) { return std::vector{reply(client, id, false)}; },
                 AllOf(HasSubstr("code = protocol"), HasSubstr("has had no first reply")));
}

TEST_F(RogueServerTest, AReplyAfterAFateIsCut) {
  expectFarewell([](auto client,
                    auto id) { return std::vector{fate(client, id, 0), reply(client, id, true)}; },
                 HasSubstr("is not pending"));
  EXPECT_THAT(fates(), ElementsAre(Fate::refused));
}

TEST_F(RogueServerTest, ClientsThatWereNeverOpenedAreCut) {
  const auto unknown = AllOf(HasSubstr("code = protocol"), HasSubstr("client 99 was never opened"));
  expectFarewell([](auto, auto id) { return std::vector{reply(99, id, true)}; }, unknown);
  expectFarewell([](auto, auto id) { return std::vector{fate(99, id, 0)}; }, unknown);
  expectFarewell(
      [](auto, auto) { return std::vector<Fill>{[](auto item) { item.setQueueFull(99); }}; },
      unknown);
  expectFarewell(
      [](auto, auto) {
        return std::vector<Fill>{[](auto item) { item.initRefuse().setClient(99); }};
      },
      unknown);
}

// The other client has sent no request.
TEST_F(RogueServerTest, AReplyToAnotherClientIsCut) {
  auto peer = rogue();
  const auto first = client_;
  Caller other(*dispatcher_, "echo", kRogueLocation);
  const auto second = await(peer, wire::Item::OPEN).getOpen().getClient();
  ASSERT_NE(first, second);
  const auto id = asked(peer);

  peer.sendItems({reply(second, id, true, 13)});

  EXPECT_THAT(peer.farewell(), HasSubstr("is not pending"));
  peer.close();
  expectDisconnect();
  runUntil([&] { return !other.isConnected(); });
  EXPECT_THAT(other.messages, IsEmpty());
  EXPECT_THAT(fates(), ElementsAre(Fate::outcomeUnknown));
}

TEST_F(RogueServerTest, MessagesThatOnlyMpfMaySendAreCut) {
  const auto onlyOurs = AllOf(HasSubstr("code = protocol"), HasSubstr("only MPF itself may send"));
  expectFarewell(
      [](auto client, auto id) {
        return std::vector{replyOf(client, id, [](auto message) { message.initConnect(); })};
      },
      onlyOurs);
  expectFarewell(
      [](auto client, auto id) {
        return std::vector{replyOf(client, id, [](auto message) { message.initRequestFate(); })};
      },
      onlyOurs);
}

TEST_F(RogueServerTest, ItemsOfTheOtherSideAreCut) {
  expectFarewell(
      [](auto, auto) { return std::vector<Fill>{[](auto item) { item.initOpen().setClient(1); }}; },
      AllOf(HasSubstr("code = protocol"), HasSubstr("only a client router sends")));
}

// ---- unusual items that the protocol permits

TEST_F(RogueServerTest, AnUnknownMessageTypeIsOutcomeUnknown) {
  auto peer = rogue();
  const auto id = asked(peer);
  auto bytes =
      frameOf({replyOf(client_, id, [](auto message) { message.initUser().initValue(800); })});
  bytes[bytes.size() - 32 - 800] = 99;
  peer.send(bytes);

  runUntil([&] { return !caller_->messages.empty(); });

  EXPECT_THAT(fates(), ElementsAre(Fate::outcomeUnknown));
  peer.sendItems({reply(client_, asked(peer), true, 3)});
  EXPECT_EQ(nextValue(), 3);
}

TEST_F(RogueServerTest, AnUnknownFateIsOutcomeUnknown) {
  auto peer = rogue();
  const auto id = asked(peer);

  peer.sendItems({fate(client_, id, 12'345), fate(client_, id, 0), fate(client_, id + 5, 0)});
  runUntil([&] { return caller_->open.empty(); });

  EXPECT_THAT(fates(), ElementsAre(Fate::outcomeUnknown));
}

TEST_F(RogueServerTest, ARefusedBindIsRepeated) {
  auto peer = host_.accept();
  peer.sendItems({greeting()});
  const auto binding = await(peer, wire::Item::BIND).getBind().getBinding();
  peer.sendItems(
      {server(binding, wire::Server::State::REFUSED), server(binding, wire::Server::State::THERE)});

  makeThere(peer);

  EXPECT_GT(binding_, binding);
}

TEST_F(RogueServerTest, RequestsOfARefusedClientAreRefusedLocally) {
  auto peer = rogue();
  peer.sendItems({[this](auto item) { item.initRefuse().setClient(client_); }, ping(1)});
  await(peer, wire::Item::PONG);

  caller_->send(Int32Message({.value = 1}));
  runUntil([&] { return caller_->open.empty(); });

  EXPECT_THAT(fates(), ElementsAre(Fate::refused));
}

TEST_F(RogueServerTest, ThatAcceptsOneClientGetsOne) {
  auto peer = host_.accept();
  peer.sendItems({greeting([](auto greeting) { greeting.setMaxClients(1); })});
  makeThere(peer);
  Caller other(*dispatcher_, "echo", kRogueLocation);
  runUntil([&] { return other.isConnected(); });

  other.send(Int32Message({.value = 1}));
  runUntil([&] { return other.open.empty(); });

  EXPECT_EQ(fateOf(other.take()), Fate::refused);
  peer.sendItems({reply(client_, asked(peer), true, 3)});
  EXPECT_EQ(nextValue(), 3);
}

// ---- floods

TEST_F(RogueServerTest, RepliesBeyondTheWindowAreCut) {
  auto peer = rogue();
  const auto id = asked(peer);
  const std::vector<Fill> more(
      100, replyOf(client_, id, [](auto message) { message.initUser().initValue(1000); }, false));
  const auto before = usage();
  peer.sendItems({reply(client_, id, true)});
  const auto frame = frameOf(more);

  while (peer.send(frame)) {  // its client receives none of them
  }

  expectUsage(before, 24 << 10);
  expectDisconnect();
}

TEST_F(RogueServerTest, NotificationsOfFullQueuesDoNotAccumulate) {
  auto peer = rogue();
  asked(peer);
  const auto frame =
      frameOf(std::vector<Fill>(10'000, [this](auto item) { item.setQueueFull(client_); }));
  const auto before = usage();

  for (int i = 0; i < 100; ++i) ASSERT_TRUE(peer.send(frame));
  peer.sendItems({ping(4242)});
  while (peer.next(wire::Item::PONG).getPong().getStamp() != 4242) {
  }

  expectUsage(before, 24 << 10);
  expectHonestWork();
}

TEST_F(RogueServerTest, AServerThatRestartsOftenDoesNotAffectOthers) {
  auto peer = rogue();
  std::vector<Fill> items;
  for (std::uint64_t life = 0; life < 1000; ++life) {
    items.push_back(server(binding_, wire::Server::State::ABSENT));
    items.push_back(server(binding_, wire::Server::State::THERE, kIncarnation + 1 + life));
  }
  items.push_back(ping(4242));

  peer.sendItems(items);
  expectHonestWork();
  while (await(peer, wire::Item::PONG).getPong().getStamp() != 4242) {
  }

  runUntil([&] { return caller_->isConnected(); });
  const auto said = routers_.nearRouter().said();
  std::size_t lines = 0;
  for (auto at = said.find(" is available"); at != std::string::npos;
       at = said.find(" is available", at + 1))
    ++lines;
  EXPECT_LT(lines, items.size() / 10) << "the log would become too long";
}

// As a newer peer may send it.
TEST_F(RogueServerTest, AnUnknownStateIsOutcomeUnknown) {
  auto peer = rogue();
  asked(peer);

  peer.sendItems({server(binding_, static_cast<wire::Server::State>(7))});

  expectDisconnect();
  EXPECT_THAT(fates(), testing::ElementsAre(Fate::outcomeUnknown));
  expectHonestWork();
}

class RogueGreeterTest : public RogueTest {};

TEST_F(RogueGreeterTest, ThatClosesAfterItsGreetingIsConnectedToLessAndLessOften) {
  constexpr int kCalls = 10;
  // half of 1 ms, 2 ms, 4 ms...
  constexpr std::int64_t kAtLeastNs = ((1 << (kCalls - 1)) - 1) * 500'000;
  RogueHost host;
  startAll({}, {"--remote", "2=" + host.address(), "--first-retry", "1ms", "--last-retry", "1min"});
  const auto beganNs = Clock::nowNs();

  for (int call = 0; call < kCalls; ++call) {
    auto peer = host.accept();
    peer.sendItems({greeting()});
    static_cast<void>(peer.next(wire::Item::GREETING));
  }

  EXPECT_GE(Clock::nowNs() - beganNs, kAtLeastNs);
}

}  // namespace
}  // namespace mpf::test
