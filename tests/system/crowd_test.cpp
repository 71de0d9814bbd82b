// SPDX-License-Identifier: MIT
// Three hundred clients at once, in many processes: all connect, and all find the next server.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

#include "shm/segment_name.h"
#include "shm/window.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

class CrowdTest : public testing::Test {
 protected:
  static constexpr int kProcesses = 30;
  static constexpr int kClientsOfEach = 10;

  void startCrowd() {
    for (int i = 0; i < kProcesses; ++i)
      crowd_.emplace_back("crowd", backplane_.name(), std::vector{std::to_string(kClientsOfEach)});
  }
  void waitUntilBound() {
    for (auto& process : crowd_) EXPECT_THAT(process.line(), testing::StartsWith("waiting: "));
  }
  void startServer() {
    server_ = Victim();
    server_ = Victim("serve", backplane_.name());
    EXPECT_EQ(server_.line(), "open");
  }
  // Waits until the current server has answered all requests of every client.
  void waitUntilAnswered() {
    const auto window = PeerWindow::tryOpen(SegmentName::serverWindow(backplane_.name(), 0, "echo"),
                                            layout::SegmentKind::serverWindow);
    ASSERT_TRUE(window);
    const auto all = fmt::format("answered {:x}", window->header().incarnation);
    for (auto& process : crowd_) {
      auto line = process.line();
      // Answered by an earlier server.
      while (line != all && (line.starts_with("answered ") || line.starts_with("waiting: ")))
        line = process.line();
      ASSERT_EQ(line, all);
    }
    EXPECT_EQ(window->control().linksOpened.load(), kProcesses * kClientsOfEach);
    EXPECT_EQ(window->control().protocolErrors.load(), 0u);
  }

  Watchdog watchdog_{"crowd test"};
  TestBackplane backplane_;
  Victim server_;
  std::vector<Victim> crowd_;
};

TEST_F(CrowdTest, ThreeHundredWaitingClientsConnectAndGetReplies) {
  startCrowd();
  waitUntilBound();

  startServer();

  waitUntilAnswered();
}

TEST_F(CrowdTest, ThreeHundredClientsThatStartAtOnceGetReplies) {
  startServer();

  startCrowd();

  waitUntilAnswered();
}

TEST_F(CrowdTest, AllFindTheSuccessorOfAServerThatEndsUnderLoad) {
  for (const int signal : {SIGKILL, SIGTERM}) {
    startServer();
    crowd_.clear();
    startCrowd();
    EXPECT_THAT(crowd_.front().line(), testing::StartsWith("waiting: "));
    EXPECT_THAT(crowd_.front().line(), testing::StartsWith("answered "));

    server_.end(signal);
    startServer();

    waitUntilAnswered();
  }
}

TEST_F(CrowdTest, AllFindOneSuccessorAfterTheOther) {
  startServer();
  startCrowd();
  waitUntilAnswered();

  for (int life = 0; life < 5; ++life) {
    server_.end(life % 2 == 0 ? SIGKILL : SIGTERM);
    startServer();
    waitUntilAnswered();
  }
}

}  // namespace
}  // namespace mpf::test
