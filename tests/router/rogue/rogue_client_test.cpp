// SPDX-License-Identifier: MIT
// A rogue connects to a server router. A violation of the protocol ends its connection, and honest
// clients are not affected.
#include "tests/router/rogue/rogue_client.h"

#include <cstring>
#include <utility>

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr std::size_t kSlackKb = 24 << 10;

TEST_F(RogueClientTest, IsServedWhileItFollowsTheProtocol) {
  auto peer = rogue();

  for (std::uint32_t id = 1; id <= 3; ++id) expectAnswer(peer, 1, id, 42);
}

TEST_F(RogueClientTest, IsCutWithoutAGreeting) {
  RoguePeer peer(routers_.address());
  peer.sendItems({bind(1)});
  EXPECT_THAT(peer.farewell(), AllOf(HasSubstr("code = protocol"), HasSubstr("is not a greeting")));
}

// ---- invalid items

TEST_F(RogueClientTest, UnknownNumbersAreCut) {
  expectFarewell(frameOf({request(2, 1)}),
                 AllOf(HasSubstr("code = protocol"), HasSubstr("client 2 was never opened")));
  expectFarewell(frameOf({request(0, 1)}), HasSubstr("client 0 was never opened"));
  expectFarewell(frameOf({credit(9, 1)}), HasSubstr("client 9 was never opened"));
}

TEST_F(RogueClientTest, DuplicateNumbersAreCut) {
  expectFarewell(frameOf({bind(1)}),
                 AllOf(HasSubstr("code = protocol"), HasSubstr("binding 1 is open already")));
  expectFarewell(frameOf({open(1, 1, 0)}),
                 AllOf(HasSubstr("code = protocol"),
                       HasSubstr("client number 1 is not greater than the last one, 1")));
  expectFarewell(frameOf({close(1), open(1, 1, 0)}),
                 HasSubstr("client number 1 is not greater than the last one, 1"));
  expectFarewell(frameOf({open(0, 1, 0)}),
                 HasSubstr("client number 0 is not greater than the last one, 1"));
}

TEST_F(RogueClientTest, RequestsWithoutAnIdAreCut) {
  expectFarewell(frameOf({request(1, 0)}), HasSubstr("requestId 0"));
}

TEST_F(RogueClientTest, ItemsOfTheOtherSideAreCut) {
  for (const auto& item :
       {Fill([](auto i) { i.initServer(); }), Fill([](auto i) { i.initReply().setClient(1); }),
        Fill([](auto i) { i.initFate().setClient(1); }),
        Fill([](auto i) { i.initRefuse().setClient(1); }),
        Fill([](auto i) { i.setQueueFull(1); })}) {
    expectFarewell(frameOf({item}),
                   AllOf(HasSubstr("code = protocol"), HasSubstr("only a server router sends")));
  }
}

TEST_F(RogueClientTest, TooManyClientsAreCut) {
  auto peer = rogue();
  for (std::uint32_t client = 2; client <= 20; ++client)
    peer.sendItems({open(client, 1, incarnation_)});
  expectAnswer(peer, 20, 1, 5);

  peer.sendItems({open(21, 1, incarnation_)});

  EXPECT_THAT(peer.farewell(), AllOf(HasSubstr("code = limit"), HasSubstr("more than 20 clients")));
}

TEST_F(RogueClientTest, AnInvalidMessageIsCut) {
  expectFarewell(frameOf({[](wire::Item::Builder item) {
                   auto request = item.initRequest();
                   request.setClient(1);
                   request.setRequestId(1);
                   request.initMessage().initChar8Array().initEomString(5);
                 }}),
                 AllOf(HasSubstr("code = protocol"), HasSubstr("eomString")));
}

// ---- bindings

// The largest number of bindings: all bindings to a server share the files with which it is
// observed.
TEST_F(RogueClientTest, ManyBindingsToOneServerNeedNoMoreFiles) {
  constexpr std::uint32_t kBindings = 4096;
  auto peer = rogue();
  expectAnswer(peer, 1, 1, 5);
  const auto before = usage();

  std::vector<Fill> binds;
  for (std::uint32_t binding = 2; binding <= kBindings; ++binding) binds.push_back(bind(binding));
  peer.sendItems(binds);
  for (std::uint32_t binding = 2; binding <= kBindings; ++binding) {
    ASSERT_EQ(peer.next(wire::Item::SERVER).getServer().getState(), wire::Server::State::THERE);
  }

  EXPECT_LE(usage().files, before.files);
  EXPECT_LE(usage().segments, before.segments);
}

// The end of a server whose process continues is only found by a look, and the first peer to look
// must not be the only one that is notified.
TEST_F(RogueClientTest, AllPeersAreNotifiedOfTheEndOfAServer) {
  honest_.reset();
  std::vector<RoguePeer> peers;
  for (int i = 0; i < 3; ++i) {
    peers.push_back(stranger());
    peers.back().sendItems({greeting()});
    peers.back().sendItems({bind(1), bind(2)});
  }
  const auto expectOfAll = [&](wire::Server::State state) {
    for (auto& peer : peers) {
      for (const int binding : {1, 2})
        EXPECT_EQ(peer.next(wire::Item::SERVER).getServer().getState(), state) << binding;
    }
  };
  expectOfAll(wire::Server::State::THERE);

  for (int life = 0; life < 3; ++life) {
    server_.reset();
    expectOfAll(wire::Server::State::ABSENT);
    server_ = std::make_unique<EchoServer>(routers_.far());
    expectOfAll(wire::Server::State::THERE);
  }
}

// ---- items that are refused, and the connection continues

TEST_F(RogueClientTest, AMessageThatIsTooLargeIsRefused) {
  auto peer = rogue();
  peer.sendItems({[](wire::Item::Builder item) {
    auto request = item.initRequest();
    request.setClient(1);
    request.setRequestId(7);
    request.initMessage().initUser().initValue((1u << 20) + 1);
  }});

  const auto fate = peer.next(wire::Item::FATE).getFate();

  EXPECT_EQ(fate.getRequestId(), 7u);
  EXPECT_EQ(fate.getFate(), wire::Fate::REFUSED);
  EXPECT_THAT(router::toStd(fate.getReason()), HasSubstr("the limit is 1048576"));
  expectAnswer(peer, 1, 8, 1);
}

TEST_F(RogueClientTest, ARequestIdInUseIsRefused) {
  auto peer = rogue();
  peer.sendItems({request(1, 1, 1), request(1, 1, 2)});

  int replies = 0;
  int refused = 0;
  while (replies + refused < 2) {
    const auto item = peer.next();
    ASSERT_TRUE(item);
    replies += item->isReply() ? 1 : 0;
    refused += item->isFate() && item->getFate().getFate() == wire::Fate::REFUSED ? 1 : 0;
  }

  EXPECT_GE(replies, 1);
  expectAnswer(peer, 1, 2, 1);
}

TEST_F(RogueClientTest, ServersThatAreNotServedAreRefused) {
  auto peer = rogue();
  std::uint32_t binding = 1;
  for (const auto& [server, location] :
       {std::pair<std::string, int>{"echo", 2}, {"", 1}, {std::string(64, 'x'), 1}, {"a\nb", 1}}) {
    peer.sendItems({bind(++binding, server, location)});
    const auto answer = peer.next(wire::Item::SERVER).getServer();
    EXPECT_EQ(answer.getBinding(), binding);
    EXPECT_EQ(answer.getState(), wire::Server::State::REFUSED) << server;
  }
  expectAnswer(peer, 1, 1, 1);
}

TEST_F(RogueClientTest, TooManyBindingsAreRefused) {
  auto peer = rogue();
  constexpr std::uint32_t kMost = 4096;
  std::vector<Fill> binds;
  for (std::uint32_t binding = 2; binding <= kMost + 10; ++binding)
    binds.push_back(bind(binding, "nobody"));
  peer.sendItems(binds);

  for (std::uint32_t binding = 2; binding <= kMost + 10; ++binding) {
    const auto answer = peer.next(wire::Item::SERVER).getServer();
    ASSERT_EQ(answer.getBinding(), binding);
    ASSERT_EQ(answer.getState(),
              binding <= kMost ? wire::Server::State::ABSENT : wire::Server::State::REFUSED);
  }
  expectAnswer(peer, 1, 1, 1);
}

// Incarnation 0 must not match an absent server.
TEST_F(RogueClientTest, RequestsToAnAbsentServerAreNeverTaken) {
  auto peer = rogue();
  peer.sendItems({bind(2, "nobody"), open(2, 2, 0), request(2, 1), open(3, 77, 0), request(3, 1),
                  open(4, 1, incarnation_ + 1), request(4, 1)});

  for (std::uint32_t client = 2; client <= 4; ++client) {
    const auto fate = peer.next(wire::Item::FATE).getFate();
    EXPECT_EQ(fate.getClient(), client);
    EXPECT_EQ(fate.getFate(), wire::Fate::NEVER_TAKEN);
  }
  expectAnswer(peer, 1, 1, 1);
}

TEST_F(RogueClientTest, ExcessiveCreditIsIgnored) {
  auto peer = rogue();
  peer.sendItems(std::vector<Fill>(100, credit(1, 0xffff'ffff)));
  expectAnswer(peer, 1, 1, 1);
}

// ---- invalid frames

// A thousand requests that point to the same body of 900 kB.
TEST_F(RogueClientTest, AThousandRequestsWithOneBodyAreCut) {
  constexpr capnp::uint kRequests = 1000;
  capnp::MallocMessageBuilder message(1u << 19);
  auto items = message.initRoot<wire::Frame>().initItems(kRequests);
  auto request = items[0].initRequest();
  request.setClient(1);
  request.setRequestId(1);
  request.initMessage().initUser().initValue(900'000);
  auto bytes = bytesOf(message);
  constexpr std::size_t kFirstItem = 8 + 3 * 8;
  std::uint64_t pointer = 0;
  std::memcpy(&pointer, &bytes[kFirstItem + 8], sizeof pointer);
  for (capnp::uint at = 1; at < kRequests; ++at) {
    std::memcpy(&bytes[kFirstItem + 16 * at], &bytes[kFirstItem], 8);
    const auto moved = pointer - (std::uint64_t{2 * at} << 2);
    std::memcpy(&bytes[kFirstItem + 16 * at + 8], &moved, sizeof moved);
  }
  const auto before = usage();

  expectFarewell(bytes, HasSubstr("code = protocol"));

  expectUsage(before, kSlackKb);
}

TEST_F(RogueClientTest, ConnectionsBeyondTheLimitAreClosed) {
  std::vector<std::unique_ptr<RoguePeer>> peers;
  int kept = 0;
  for (int i = 0; i < 100; ++i) {
    auto& peer = *peers.emplace_back(std::make_unique<RoguePeer>(routers_.address()));
    peer.sendItems({greeting()});
    try {
      peer.next(wire::Item::PING);  // it has read our greeting
      ++kept;
    } catch (const std::runtime_error& farewell) {
      EXPECT_THAT(farewell.what(), HasSubstr("its limit (max-connections)"));
      peer.close();
    }
  }

  EXPECT_EQ(kept, 29) << "and the honest one is the 30th";
}

}  // namespace
}  // namespace mpf::test
