// SPDX-License-Identifier: MIT
// RogueServerTest: a client router has connected to a rogue.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/router/rogue/rogue_fixture.h"
#include "tests/router/server_items.h"
#include "tests/support/caller.h"

namespace mpf::test {

// Local clients that are bound to a server of the rogue.
class RogueServerTest : public RogueTest {
 protected:
  static constexpr std::int32_t kRogueLocation = 2;

  explicit RogueServerTest(std::string deadTime = "60s") : deadTime_(std::move(deadTime)) {}

  void SetUp() override {
    startAll({},
             {"--remote", std::to_string(kRogueLocation) + "=" + host_.address(), "--window-size",
              "64KiB", "--dead-time", deadTime_, "--first-retry", "10ms", "--last-retry", "10ms"});
    dispatcher_.emplace(routers_.near());
    caller_.emplace(*dispatcher_, "echo", kRogueLocation);
  }
  void TearDown() override {
    caller_.reset();
    dispatcher_.reset();
    RogueTest::TearDown();
  }

  // A peer that has accepted the connection and sent nothing.
  [[nodiscard]] RoguePeer stranger() { return host_.accept(); }
  // A rogue that has followed the protocol so far: it has greeted and offered the server, which has
  // its first client.
  [[nodiscard]] RoguePeer rogue() {
    auto peer = stranger();
    peer.sendItems({greeting()});
    makeThere(peer);
    return peer;
  }
  void makeThere(RoguePeer& peer) {
    binding_ = await(peer, wire::Item::BIND).getBind().getBinding();
    peer.sendItems({server(binding_, wire::Server::State::THERE)});
    client_ = await(peer, wire::Item::OPEN).getOpen().getClient();
    runUntil([&] { return caller_->isConnected(); });
  }
  template <class Condition>
  void runUntil(Condition condition) {
    while (!condition()) dispatcher_->runOnce(Deadline::after(std::chrono::microseconds(200)));
  }
  // Returns the next item of this kind, and runs the local clients until it arrives.
  wire::Item::Reader await(RoguePeer& peer, wire::Item::Which kind) {
    for (;;) {
      runUntil([&] { return peer.hasData(); });
      const auto item = peer.next();
      if (!item || item->isFarewell())
        throw std::runtime_error(item ? router::toStd(kj::str(*item)) : "closed");
      if (item->which() == kind) return *item;
      if (item->isPing())
        peer.sendItems(
            {[stamp = item->getPing().getStamp()](auto pong) { pong.initPong().setStamp(stamp); }});
    }
  }
  // Sends a request, waits until the rogue has received it, and returns its id.
  std::uint32_t asked(RoguePeer& peer) {
    caller_->send(Int32Message({.value = 1}));
    return await(peer, wire::Item::REQUEST).getRequest().getRequestId();
  }
  // A reply of a rogue that follows the protocol.
  Fill message(RoguePeer& peer, const FillMessage& fill) {
    return replyOf(client_, asked(peer), fill);
  }
  // The rogue receives a request, sends `answers`, and receives `farewell`. The request ends once,
  // and the local client is disconnected.
  void expectFarewell(
      const std::function<std::vector<Fill>(std::uint32_t client, std::uint32_t id)>& answers,
      const testing::Matcher<const std::string&>& farewell) {
    auto peer = rogue();
    const auto id = asked(peer);
    EXPECT_TRUE(peer.sendItems(answers(client_, id)));
    EXPECT_THAT(peer.farewell(), farewell);
    peer.close();
    expectDisconnect();
    expectHonestWork();
  }
  void expectDisconnect() {
    runUntil([&] { return caller_->news.back() == ConnectStatus::connectNo; });
    EXPECT_THAT(caller_->open, testing::IsEmpty());
  }
  std::vector<Fate> fates() {
    std::vector<Fate> all;
    while (auto message = caller_->take()) {
      if (const auto fate = fateOf(message)) all.push_back(*fate);
    }
    return all;
  }
  // The value of the next reply that the client receives.
  std::int32_t nextValue() {
    runUntil([&] { return !caller_->messages.empty(); });
    const auto message = caller_->take();
    const auto* value = message.tryAs<Int32>();
    return value != nullptr ? value->value : -1;
  }
  [[nodiscard]] Usage usage() { return Usage::of(routers_.nearRouter().pid()); }
  void expectUsage(const Usage& before, std::size_t slackKb) {
    expectUsageOf(routers_.nearRouter().pid(), before, slackKb);
  }

  RogueHost host_;
  std::optional<Dispatcher> dispatcher_;
  std::optional<Caller> caller_;
  std::uint32_t binding_ = 0;
  std::uint32_t client_ = 0;

 private:
  std::string deadTime_;
};

}  // namespace mpf::test
