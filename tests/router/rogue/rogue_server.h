// SPDX-License-Identifier: MIT
// RogueServerTest: a client router has called a rogue.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/router/rogue/rogue_fixture.h"
#include "tests/support/caller.h"

namespace mpf::test {

inline constexpr std::uint64_t kIncarnation = 77;

inline Fill server(std::uint32_t binding, wire::Server::State state,
                   std::uint64_t incarnation = kIncarnation) {
  return [=](wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(binding);
    server.setState(state);
    server.setIncarnation(incarnation);
    server.setQueueSize(10);
    server.setMaxOutstanding(20);
    server.setMaxMessageBytes(1u << 20);
    server.setReason("the rogue says so");
  };
}

inline Fill replyOf(std::uint32_t client, std::uint32_t id, const FillMessage& fill,
                    bool isFirst = true) {
  return [=](wire::Item::Builder item) {
    auto reply = item.initReply();
    reply.setClient(client);
    reply.setRequestId(id);
    reply.setIsFirst(isFirst);
    fill(reply.initMessage());
  };
}

inline Fill reply(std::uint32_t client, std::uint32_t id, bool isFirst, std::int32_t value = 0) {
  return replyOf(
      client, id, [value](auto message) { message.initInt32().setValue(value); }, isFirst);
}

inline Fill fate(std::uint32_t client, std::uint32_t id, std::uint16_t fate) {
  return [=](wire::Item::Builder item) {
    auto end = item.initFate();
    end.setClient(client);
    end.setRequestId(id);
    end.setFate(static_cast<wire::Fate>(fate));
  };
}

// Local clients whose server is the rogue's.
class RogueServerTest : public RogueTest {
 protected:
  static constexpr std::int32_t kRogues = 2;  // its location

  explicit RogueServerTest(std::string deadTime = "5s") : deadTime_(std::move(deadTime)) {}

  void SetUp() override {
    startAll({},
             {"--remote", std::to_string(kRogues) + "=" + host_.address(), "--window-size", "64KiB",
              "--dead-time", deadTime_, "--first-retry", "10ms", "--last-retry", "10ms"});
    dispatcher_.emplace(routers_.near());
    caller_.emplace(*dispatcher_, "echo", kRogues);
  }
  void TearDown() override {
    caller_.reset();
    dispatcher_.reset();
    RogueTest::TearDown();
  }

  // A peer of the router that has yet to say something.
  [[nodiscard]] RoguePeer stranger() { return host_.accept(); }
  // A rogue that has been legal so far: greeted, with the server that was wished for, and its first
  // client.
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
  // The next item of that kind, while the clients live.
  wire::Item::Reader await(RoguePeer& peer, wire::Item::Which kind) {
    for (;;) {
      runUntil([&] { return peer.hasNews(); });
      const auto item = peer.next();
      if (!item || item->isFarewell())
        throw std::runtime_error(item ? router::toStd(kj::str(*item)) : "closed");
      if (item->which() == kind) return *item;
      if (item->isPing())
        peer.sendItems(
            {[stamp = item->getPing().getStamp()](auto pong) { pong.initPong().setStamp(stamp); }});
    }
  }
  // A request that the rogue has got.
  std::uint32_t asked(RoguePeer& peer) {
    caller_->send(Int32Message({.value = 1}));
    return await(peer, wire::Item::REQUEST).getRequest().getRequestId();
  }
  // One more message of a legal rogue.
  Fill message(RoguePeer& peer, const FillMessage& fill) {
    return replyOf(client_, asked(peer), fill);
  }
  // The rogue, asked once, answers so, and gets that farewell. Its client's request ends once,
  // without a reply.
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
  // The next reply that the client gets.
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
