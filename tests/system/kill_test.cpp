// SPDX-License-Identifier: MIT
// Kills processes under load at random times. MPF_TEST_KILLS sets the number of kills in each test;
// the seed is printed.
#include <array>
#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <iostream>
#include <memory>
#include <optional>
#include <random>
#include <set>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "client/relay_client.h"
#include "shm/segment_name.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class KillTest : public testing::Test {
 protected:
  KillTest() : random_(std::random_device()()) {
    const auto seed = random_();
    random_.seed(seed);
    std::cout << "seed " << seed << '\n';
  }
  std::string backplaneName() const { return backplane_.name(); }

  Watchdog watchdog_{"kill test"};
  TestBackplane backplane_;
  std::mt19937 random_;
};

// Counts the ends of requests by their ids.
struct Ledger {
  std::set<std::uint32_t> open;
  std::uint64_t accepted = 0;
  std::uint64_t replies = 0;
  std::array<std::uint64_t, 5> fates{};
  int connects = 0;
  int disconnects = 0;

  void note(const Message& message) {
    if (const auto* news = message.tryAs<Connect>()) {
      if (news->status == ConnectStatus::connectYes) ++connects;
      if (news->status != ConnectStatus::connectNo) return;
      ++disconnects;
      EXPECT_TRUE(open.empty()) << "the disconnect must follow the fates of all requests";
      return;
    }
    EXPECT_EQ(open.erase(message.route().requestId), 1u) << "a request ended that is not open";
    if (const auto* fate = message.tryAs<RequestFate>()) {
      ++fates.at(static_cast<std::size_t>(fate->fate));
    } else {
      ++replies;
    }
  }
};

// Sends a random request: small, large, or with a deadline that may pass.
void sendOne(MessageClient& client, Ledger& ledger, std::mt19937& random) {
  std::uint32_t id = 0;
  SendResult result{};
  if (random() % 4 == 0) {
    result = client.send(client.alloc<Float64Array>(random() % 2000), Deadline::never(), &id);
  } else {
    const auto deadline = random() % 8 != 0
                              ? Deadline::never()
                              : Deadline::after(std::chrono::microseconds(random() % 500));
    result = client.send(Int32Message({.value = 1}), deadline, &id);
  }
  if (result != SendResult::sent) return;
  ++ledger.accepted;
  EXPECT_TRUE(ledger.open.insert(id).second) << "the id of an open request was used again";
}

TEST_F(KillTest, EveryRequestEndsOnceWhenServersAreKilled) {
  Victim server("serve", backplaneName());
  Dispatcher dispatcher(backplane_);
  Ledger ledger;
  MessageClient client(dispatcher, [&](const Message& message) { ledger.note(message); });
  client.bind("echo");

  for (int round = 0; round < killsOr(500); ++round) {
    ASSERT_TRUE(client.connectWait(60s)) << client.notConnectedBecause();
    const auto killAt = Deadline::after(std::chrono::microseconds(random_() % 3000));
    bool killed = false;
    while (client.isConnected()) {
      if (!killed && killAt.hasPassed()) {
        server.signal(SIGKILL);
        killed = true;
      }
      sendOne(client, ledger, random_);
      dispatcher.runOnce(Deadline::after(50us));
    }
    server = Victim(random_() % 3 == 0 ? "serve-block" : "serve", backplaneName());
  }

  EXPECT_TRUE(ledger.open.empty());
  EXPECT_EQ(ledger.connects, killsOr(500));
  EXPECT_EQ(ledger.disconnects, killsOr(500));
  EXPECT_EQ(ledger.accepted,
            ledger.replies + ledger.fates[0] + ledger.fates[1] + ledger.fates[2] + ledger.fates[3]);
  EXPECT_GT(ledger.replies, 0u);
}

// runOnce() handles the death as an event of its own, and returns true for it.
TEST_F(KillTest, RunOnceHandlesADeathAsAnEvent) {
  Victim server("serve", backplaneName());
  Dispatcher dispatcher(backplane_);
  bool isGone = false;
  MessageClient client(dispatcher, [&](const Message& message) {
    const auto* news = message.tryAs<Connect>();
    isGone = news != nullptr && news->status == ConnectStatus::connectNo;
  });
  client.bind("echo");
  ASSERT_TRUE(client.connectWait(60s));
  // From now on the death is the only event.
  while (!dispatcher.nextDeadline().isNever()) dispatcher.runOnce();

  server.end(SIGKILL);
  static_cast<void>(backplane_.removeDead());  // removes the window, too

  while (!isGone) EXPECT_TRUE(dispatcher.runOnce());
}

TEST_F(KillTest, AServerContinuesWhenClientsAreKilled) {
  Victim server("serve", backplaneName());

  for (int round = 0; round < killsOr(500); ++round) {
    Victim client("flood", backplaneName());
    const auto until = Deadline::after(std::chrono::microseconds(random_() % 8000));
    SyncClient witness(backplane_, "echo");
    do {
      auto answer = witness.call(Float64Message({.value = round + 0.5}), 60s);
      ASSERT_TRUE(answer) << answer.why();
      EXPECT_EQ(answer.message().tryAs<Float64>()->value, round + 1.5);
    } while (!until.hasPassed());
    client.end(SIGKILL);
  }

  const auto status = server.end(SIGTERM);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

// The server ends before it notices or handles the death of its clients, and no other process could
// remove their segments.
TEST_F(KillTest, AServerThatEndsRemovesItsDeadClients) {
  auto server = std::make_unique<MessageServer>(backplane_, "echo");
  Victim client("flood", backplaneName());
  while (!server->receive()) server->waitForMessage(Deadline::after(60s));

  client.end(SIGKILL);
  server.reset();

  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
}

TEST_F(KillTest, AKilledServersNameCanBeUsedAtOnce) {
  for (int round = 0; round < killsOr(500) / 4; ++round) {
    Victim server("serve", backplaneName());
    SyncClient client(backplane_, "echo");
    ASSERT_TRUE(client.call(Float64Message({.value = 1}), 60s));

    server.end(SIGKILL);
    Victim successor("serve", backplaneName());
    ASSERT_EQ(successor.line(), "open");

    Answer answer = client.call(Float64Message({.value = 2}), 60s);
    // The fate of a call that was open when the server died.
    while (!answer) answer = client.call(Float64Message({.value = 2}), 60s);
    EXPECT_EQ(answer.message().tryAs<Float64>()->value, 3);
  }
}

// The client pauses again while it receives the last messages of its server; that pause ends with
// the server.
TEST_F(KillTest, AClientThatPausesAtItsServersEndMayContinue) {
  Victim server("serve", backplaneName());
  ASSERT_EQ(server.line(), "open");
  int replies = 0;
  std::optional<ConnectStatus> news;
  Dispatcher dispatcher(backplane_);
  std::unique_ptr<RelayClient> client;
  client = std::make_unique<RelayClient>(dispatcher, [&](const Message& message) {
    if (const auto* connect = message.tryAs<Connect>()) {
      news = connect->status;
    } else {
      ++replies;
      client->pause();
    }
  });
  client->bind("echo");
  while (!client->isConnected()) dispatcher.runOnce(Deadline::after(1ms));
  client->pause();
  ASSERT_EQ(client->send(Float64Message()), SendResult::sent);
  ASSERT_EQ(client->send(Float64Message()), SendResult::sent);
  SyncClient other(backplane_, "echo");
  ASSERT_TRUE(other.call(Float64Message(), 60s)) << "as the two calls before it";

  server.end(SIGKILL);
  while (news != ConnectStatus::connectNo) dispatcher.runOnce(Deadline::after(1ms));
  client->resume();

  EXPECT_EQ(replies, 2);
}

TEST_F(KillTest, AStoppedServerIsNotDead) {
  Victim server("serve", backplaneName());
  SyncClient client(backplane_, "echo");
  ASSERT_TRUE(client.call(Float64Message({.value = 1}), 60s));

  server.stop();
  auto late = client.call(Float64Message({.value = 2}), 100ms);
  EXPECT_FALSE(late);
  EXPECT_TRUE(client.client().isConnected());
  server.signal(SIGCONT);

  auto answer = client.call(Float64Message({.value = 3}), 60s);
  ASSERT_TRUE(answer) << answer.why();
  EXPECT_EQ(answer.message().tryAs<Float64>()->value, 4)
      << "a late reply must not be taken for the reply to this request";
}

}  // namespace
}  // namespace mpf::test
