// SPDX-License-Identifier: MIT
// Many clients through one pair of routers: each gets its own replies, and all find the restarted
// server.
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

class RouterCrowdTest : public RouterTest {
 protected:
  static constexpr int kProcesses = 15;
  static constexpr int kClientsOfEach = 10;

  RouterCrowdTest() { ::setenv("MPF_LOCATION", std::to_string(RouterPair::kLocation).c_str(), 1); }
  void startServer() {
    echo_ = {};
    echo_ = Victim("serve", routers_.far().name());
    EXPECT_EQ(echo_.line(), "open");
  }
  void startCrowd() {
    for (int i = 0; i < kProcesses; ++i)
      crowd_.emplace_back("crowd", routers_.near().name(),
                          std::vector{std::to_string(kClientsOfEach)});
  }
  void waitUntilAllAreAnswered() {
    for (auto& process : crowd_) waitUntilAnswered(process);
  }
  void TearDown() override {
    crowd_.clear();
    echo_ = {};
    RouterTest::TearDown();
  }

  Victim echo_;
  std::vector<Victim> crowd_;
};

TEST_F(RouterCrowdTest, AHundredClientsThatStartAtOnceEachGetTheirOwnReplies) {
  routers_.start();
  startServer();

  startCrowd();

  waitUntilAllAreAnswered();
}

TEST_F(RouterCrowdTest, AllGetRepliesAfterEachRestartOfTheServer) {
  routers_.start();
  startServer();
  startCrowd();
  waitUntilAllAreAnswered();

  for (const int signal : {SIGTERM, SIGKILL, SIGTERM}) {
    echo_.end(signal);
    startServer();
    waitUntilAllAreAnswered();
  }
}

// The remote router notices at the same moment that a server has ended and that its successor is
// running: some clients connect again before others are notified of the end.
TEST_F(RouterCrowdTest, AllFindAServerThatStartedWhileTheRouterWasStopped) {
  routers_.start();
  startServer();
  startCrowd();
  waitUntilAllAreAnswered();

  for (const int signal : {SIGTERM, SIGKILL}) {
    routers_.farRouter().stop();
    echo_.end(signal);
    startServer();
    routers_.farRouter().resume();
    waitUntilAllAreAnswered();
  }
}

}  // namespace
}  // namespace mpf::test
