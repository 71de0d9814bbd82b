// SPDX-License-Identifier: MIT
// SIGINT and SIGTERM end a server in order: it removes its names and notifies its clients.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <set>
#include <vector>

#include <mpf/sync_client.h>

#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class StopTest : public testing::TestWithParam<int> {
 protected:
  // Waits until runUntilSignal() runs; an earlier signal would kill the process.
  Victim startServer() const {
    Victim server("serve", backplane_.name());
    SyncClient client(backplane_, "echo", 0);
    auto answer = client.call(Float64Message(), 60s);
    EXPECT_TRUE(answer) << answer.why();
    return server;
  }
  bool hasWindow() const {
    return segments::probeOwner(SegmentName::serverWindow(backplane_.name(), 0, "echo")) !=
           segments::Owner::absent;
  }
  // No process has died, so no segment may be left.
  void TearDown() override { EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty()); }

  Watchdog watchdog_{"stop test"};
  TestBackplane backplane_;
};

void expectEndedInOrder(int status) {
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_P(StopTest, AServerEndsAndRemovesItsNames) {
  auto server = startServer();
  EXPECT_TRUE(hasWindow());

  expectEndedInOrder(server.end(GetParam()));

  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
}

TEST_P(StopTest, EachRequestOfItsClientsEndsOnce) {
  auto server = startServer();
  std::multiset<std::uint32_t> ended;
  std::vector<ConnectStatus> news;
  Dispatcher dispatcher(backplane_);
  MessageClient client(dispatcher, [&](const Message& message) {
    if (const auto* connect = message.tryAs<Connect>()) {
      news.push_back(connect->status);
    } else {
      EXPECT_EQ(news.size(), 1u) << "the disconnect must follow the ends of all requests";
      ended.insert(message.route().requestId);
    }
  });
  client.bind("echo", 0);
  ASSERT_TRUE(client.connectWait(60s));
  std::set<std::uint32_t> accepted;
  const auto send = [&](int requests) {
    for (std::uint32_t id = 0; requests > 0; --requests) {
      ASSERT_EQ(client.send(Int32Message(), Deadline::never(), &id), SendResult::sent);
      accepted.insert(id);
    }
  };
  send(8);  // the server keeps one of seven, and drops it when it ends
  SyncClient witness(backplane_, "echo", 0);
  ASSERT_TRUE(witness.call(Float64Message(), 60s));

  server.signal(SIGSTOP);
  send(8);  // the server may receive these or not
  server.signal(GetParam());
  expectEndedInOrder(server.end(SIGCONT));
  while (client.isConnected()) dispatcher.runOnce();

  EXPECT_THAT(ended, testing::ElementsAreArray(accepted));
  EXPECT_THAT(news, testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo));
}

TEST_P(StopTest, AServerEndsWhileClientsSendAsFastAsTheyCan) {
  auto server = startServer();
  std::vector<Victim> clients;
  for (int i = 0; i < 4; ++i) clients.emplace_back("flood", backplane_.name());
  for (auto& client : clients) EXPECT_EQ(client.line(), "connected");

  expectEndedInOrder(server.end(GetParam()));

  EXPECT_FALSE(hasWindow());
  clients.clear();
  static_cast<void>(backplane_.removeDead());  // the clients were killed
}

TEST_P(StopTest, ASecondSignalDoesNoHarm) {
  for (int round = 0; round < 20; ++round) {
    auto server = startServer();
    server.signal(GetParam());
    server.signal(GetParam());

    const auto status = server.end(SIGTERM);

    // A signal after runUntilSignal() has returned ends the process at once.
    EXPECT_TRUE(WIFEXITED(status) || WTERMSIG(status) == GetParam() || WTERMSIG(status) == SIGTERM);
    static_cast<void>(backplane_.removeDead());
  }
}

INSTANTIATE_TEST_SUITE_P(OnEachSignal, StopTest, testing::Values(SIGINT, SIGTERM),
                         [](const auto& parameter) {
                           return parameter.param == SIGINT ? "Interrupt" : "Terminate";
                         });

}  // namespace
}  // namespace mpf::test
