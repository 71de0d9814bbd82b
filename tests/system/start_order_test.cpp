// SPDX-License-Identifier: MIT
// Client and server may start in any order; one process at a time serves a name.
#include <unistd.h>

#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

#include <mpf/message_server.h>

#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

class StartOrderTest : public testing::Test {
 protected:
  Victim startServer() const { return {"serve", backplane_.name()}; }
  Victim startClient() const { return {"crowd", backplane_.name(), {"1"}}; }
  // The path of the server's window.
  std::string windowPath() const {
    return segments::path(SegmentName::serverWindow(backplane_.name(), 0, "echo"));
  }

  Watchdog watchdog_{"start order test"};
  TestBackplane backplane_;
};

TEST_F(StartOrderTest, AClientMayStartBeforeItsServer) {
  auto client = startClient();
  EXPECT_EQ(client.line(), "waiting: server \"echo\" at location 0 is not running");

  auto server = startServer();

  EXPECT_THAT(client.line(), testing::StartsWith("answered "));
}

TEST_F(StartOrderTest, AServerMayStartBeforeItsClient) {
  auto server = startServer();
  EXPECT_EQ(server.line(), "open");

  auto client = startClient();

  EXPECT_THAT(client.line(), testing::StartsWith("waiting: "));
  EXPECT_THAT(client.line(), testing::StartsWith("answered "));
}

TEST_F(StartOrderTest, BothMayStartAtTheSameTime) {
  for (int round = 0; round < 50; ++round) {
    auto first = round % 2 == 0 ? startClient() : startServer();
    auto second = round % 2 == 0 ? startServer() : startClient();
    auto& client = round % 2 == 0 ? first : second;

    EXPECT_THAT(client.line(), testing::StartsWith("waiting: "));
    EXPECT_THAT(client.line(), testing::StartsWith("answered "));
  }
}

TEST_F(StartOrderTest, AServerThatRestartsIsFoundUnderItsNewPid) {
  auto server = startServer();
  auto client = startClient();
  EXPECT_THAT(client.line(), testing::StartsWith("waiting: "));
  const auto before = client.line();
  const auto pidBefore = server.pid();

  server.end(SIGTERM);
  server = startServer();

  EXPECT_NE(server.pid(), pidBefore);
  const auto after = client.line();
  EXPECT_THAT(after, testing::StartsWith("answered "));
  EXPECT_NE(after, before) << "each server has its own incarnation";
}

TEST_F(StartOrderTest, ASecondServerOfANameIsToldWhichProcessServesIt) {
  auto first = startServer();
  EXPECT_EQ(first.line(), "open");

  auto second = startServer();

  EXPECT_EQ(second.line(),
            fmt::format("error: server \"echo\" at location 0 is already running: mpf_test_victim, "
                        "pid {} ({}); stop it, or use another name, location or backplane",
                        first.pid(), windowPath()));
  const auto status = second.wait();
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1);
  auto client = startClient();
  EXPECT_THAT(client.line(), testing::StartsWith("waiting: "));
  EXPECT_THAT(client.line(), testing::StartsWith("answered ")) << "the first server continues";
}

TEST_F(StartOrderTest, ASuccessorOfAKilledServerOpensAtOnce) {
  auto client = startClient();
  EXPECT_THAT(client.line(), testing::StartsWith("waiting: "));
  for (int round = 0; round < 20; ++round) {
    auto server = startServer();
    EXPECT_EQ(server.line(), "open");
    EXPECT_THAT(client.line(), testing::StartsWith("answered "));

    server.end(SIGKILL);
  }
}

// By default a user has 128 inotify instances, which other programs may use up.
TEST_F(StartOrderTest, AClientFindsItsServerWithoutInotify) {
  constexpr int kMostToTake = 900;  // a process may have 1024 files
  int limit = 0;
  std::ifstream("/proc/sys/fs/inotify/max_user_instances") >> limit;
  if (::geteuid() != 0 || limit > kMostToTake)
    GTEST_SKIP() << "only root can use up the instances of a user without other programs";
  Victim client("crowd", backplane_.name(), {"1", "as", "65533", "65533", "without-inotify"});
  EXPECT_EQ(client.line(), "waiting: server \"echo\" at location 0 is not running");

  MessageServer server(backplane_, "echo", {.location = 0, .rights = {.mode = 0666}});
  server.on<Float64>([](Float64& request) { request.value += 1; });
  std::thread serving([&] { server.run(); });

  EXPECT_THAT(client.line(), testing::StartsWith("answered "));
  server.interrupt();
  serving.join();
}

TEST_F(StartOrderTest, OneOfManyServersThatStartAtOnceServes) {
  std::vector<Victim> servers;
  for (int i = 0; i < 10; ++i) servers.push_back(startServer());

  int open = 0;
  int refused = 0;
  for (auto& server : servers) {
    const auto line = server.line();
    open += line == "open" ? 1 : 0;
    refused +=
        line.starts_with("error: server \"echo\" at location 0 is already running: ") ? 1 : 0;
  }

  EXPECT_EQ(open, 1);
  EXPECT_EQ(refused, 9);
}

}  // namespace
}  // namespace mpf::test
