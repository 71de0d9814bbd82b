// SPDX-License-Identifier: MIT
// RogueClientTest: a rogue connects to a server router.
#pragma once

#include <string>
#include <utility>

#include "tests/router/client_items.h"
#include "tests/router/rogue/rogue_fixture.h"

namespace mpf::test {

class RogueClientTest : public RogueTest {
 protected:
  explicit RogueClientTest(std::string deadTime = "60s") : deadTime_(std::move(deadTime)) {}

  void SetUp() override {
    startAll({"--dead-time", deadTime_, "--max-clients", "20", "--max-message-size", "1MiB",
              "--max-connections", "30"},
             {});
  }

  // A peer that has connected and sent nothing.
  [[nodiscard]] RoguePeer stranger() { return RoguePeer(routers_.address()); }
  // A rogue that has followed the protocol so far: it has greeted, bound to the server (binding 1),
  // and opened a client (1).
  [[nodiscard]] RoguePeer rogue() {
    auto peer = stranger();
    peer.sendItems({greeting()});
    peer.sendItems({bind(1)});
    incarnation_ = peer.next(wire::Item::SERVER).getServer().getIncarnation();
    peer.sendItems({open(1, 1, incarnation_)});
    return peer;
  }
  // Another request of a rogue that follows the protocol.
  Fill message(RoguePeer&, const FillMessage& fill) { return requestOf(1, ++lastId_, fill); }
  // A rogue sends `bytes` and receives `farewell`.
  void expectFarewell(const Bytes& bytes, const testing::Matcher<const std::string&>& farewell) {
    auto peer = rogue();
    EXPECT_TRUE(peer.send(bytes));
    EXPECT_THAT(peer.farewell(), farewell);
    expectHonestWork();
  }
  void expectAnswer(RoguePeer& peer, std::uint32_t client, std::uint32_t id, std::int32_t value) {
    ASSERT_TRUE(peer.sendItems({request(client, id, value)}));
    auto reply = peer.next(wire::Item::REPLY).getReply();
    while (reply.getClient() != client) reply = peer.next(wire::Item::REPLY).getReply();
    EXPECT_EQ(reply.getRequestId(), id);
    EXPECT_TRUE(reply.getIsFirst());
    EXPECT_EQ(reply.getMessage().getInt32().getValue(), value);
  }
  [[nodiscard]] Usage usage() { return Usage::of(routers_.farRouter().pid()); }
  void expectUsage(const Usage& before, std::size_t slackKb) {
    expectUsageOf(routers_.farRouter().pid(), before, slackKb);
  }

  std::uint64_t incarnation_ = 0;

 private:
  std::string deadTime_;
  std::uint32_t lastId_ = 0;
};

}  // namespace mpf::test
