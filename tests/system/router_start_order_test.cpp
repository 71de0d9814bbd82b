// SPDX-License-Identifier: MIT
// Client, routers and server may start in any order; each may end and restart.
#include <algorithm>
#include <array>
#include <csignal>
#include <string>

#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

enum class Part { client, nearRouter, farRouter, server };
using Order = std::array<Part, 4>;
constexpr std::array<const char*, 4> kNames{"Client", "NearRouter", "FarRouter", "Server"};

const char* nameOf(Part part) { return kNames.at(static_cast<std::size_t>(part)); }

class RouterStartOrderTest : public RouterTest {
 protected:
  void startPart(Part part) {
    switch (part) {
      case Part::client:
        caller_.emplace(*dispatcher_);
        return;
      case Part::nearRouter:
        return routers_.startNear();
      case Part::farRouter:
        return routers_.startFar();
      case Part::server:
        return openServer();
    }
  }
  void endPart(Part part, int signal) {
    switch (part) {
      case Part::client:
        caller_.reset();
        return;
      case Part::nearRouter:
        routers_.nearRouter().end(signal);
        return;
      case Part::farRouter:
        routers_.farRouter().end(signal);
        return;
      case Part::server:
        server_.reset();
        return;
    }
  }
};

class RouterAnyOrderTest : public RouterStartOrderTest, public testing::WithParamInterface<Part> {};

// For each program that starts first, all six orders of the others.
TEST_P(RouterAnyOrderTest, AllMeet) {
  Order order{Part::client, Part::nearRouter, Part::farRouter, Part::server};
  do {
    if (order.front() != GetParam()) continue;
    for (const auto part : order) {
      startPart(part);
      // The programs that are running connect as far as they can.
      for (int i = 0; i < 50; ++i) dispatcher_->runOnce(Deadline::after(100us));
    }
    expectAnswer();
    for (const auto part : order) endPart(part, SIGTERM);
  } while (std::ranges::next_permutation(order).found);
}

INSTANTIATE_TEST_SUITE_P(First, RouterAnyOrderTest,
                         testing::Values(Part::client, Part::nearRouter, Part::farRouter,
                                         Part::server),
                         [](const auto& parameter) { return nameOf(parameter.param); });

class RouterComesBackTest : public RouterStartOrderTest, public testing::WithParamInterface<Part> {
 protected:
  void SetUp() override { startAll(); }
};

TEST_P(RouterComesBackTest, TheClientConnectsAgainByItself) {
  for (const int signal : {SIGTERM, SIGKILL}) {
    expectAnswer();
    caller_->news.clear();

    endPart(GetParam(), signal);
    runUntil([&] { return !caller_->isConnected(); });
    startPart(GetParam());
    runUntil([&] { return caller_->isConnected(); });

    EXPECT_THAT(caller_->news,
                testing::ElementsAre(ConnectStatus::connectNo, ConnectStatus::connectYes));
  }
  expectAnswer();
}

// It restarts before the others have noticed its end.
TEST_P(RouterComesBackTest, AProgramMayRestartBeforeTheOthersNoticeItsEnd) {
  std::vector<ConnectStatus> expected{ConnectStatus::connectYes};
  for (const int signal : {SIGTERM, SIGKILL, SIGTERM, SIGKILL}) {
    endPart(GetParam(), signal);
    startPart(GetParam());

    expected.insert(expected.end(), {ConnectStatus::connectNo, ConnectStatus::connectYes});
    runUntil([&] { return caller_->news.size() == expected.size(); });
    expectAnswer();
  }
  EXPECT_EQ(caller_->news, expected);
}

INSTANTIATE_TEST_SUITE_P(Each, RouterComesBackTest,
                         testing::Values(Part::nearRouter, Part::farRouter, Part::server),
                         [](const auto& parameter) { return nameOf(parameter.param); });

}  // namespace
}  // namespace mpf::test
