// SPDX-License-Identifier: MIT
// Why a client is not connected, from a snapshot.
#include "tools/call/unreachable.h"

#include <mpf/message_server.h>

#include "tests/shm/shm_fixture.h"
#include "tests/tools/report/router_rows.h"

namespace mpf::tools {
namespace {

class WhyUnreachableTest : public test::ShmTest {
 protected:
  [[nodiscard]] std::string why(std::int32_t location) const {
    return whyUnreachable(Snapshot::take(name()), "echo", location);
  }
};

TEST_F(WhyUnreachableTest, NothingIsKnownOfServersOfThisHost) {
  const MessageServer server(backplane_, "echo", {.location = 3});

  EXPECT_EQ(why(0), "");
  EXPECT_EQ(why(3), "");
}

TEST_F(WhyUnreachableTest, NoRouterHasTheLocation) {
  EXPECT_EQ(why(1), "no router of this host has a remote with location 1");
  router::Statistics statistics(backplane_, "lab1");
  const auto remote = test::connectedRemote(statistics, {2});
  EXPECT_EQ(why(1), "no router of this host has a remote with location 1");
}

TEST_F(WhyUnreachableTest, TheRouterIsNotConnected) {
  router::Statistics statistics(backplane_, "lab1");
  const auto remote = test::lostRemote(statistics);

  EXPECT_EQ(why(8), "the router is not connected to 10.0.0.8:9900: connect(): Connection refused");
}

TEST_F(WhyUnreachableTest, TheOtherHostHasNoSuchServerOrRefuses) {
  router::Statistics statistics(backplane_, "lab1");
  const auto remote = test::connectedRemote(statistics, {1, 2});

  EXPECT_EQ(why(2),
            "the router is connected to ioc1: no server of this name runs there, or the [[allow]] "
            "rules of ioc1 refuse it");
}

TEST_F(WhyUnreachableTest, AServerWithAWindowIsReachable) {
  router::Statistics statistics(backplane_, "lab1");
  const auto remote = test::connectedRemote(statistics, {2});
  auto snapshot = Snapshot::take(name());
  WindowView window;  // of the router
  window.name = "echo";
  window.location = 2;
  window.router = 1;
  snapshot.servers.push_back(window);

  EXPECT_EQ(whyUnreachable(snapshot, "echo", 2), "");
  EXPECT_NE(whyUnreachable(snapshot, "other", 2), "");

  snapshot.servers.back().life = Life::dead;
  EXPECT_NE(whyUnreachable(snapshot, "echo", 2), "");
}

TEST_F(WhyUnreachableTest, AppendsWhatElseIsKnown) {
  auto snapshot = Snapshot::take(name());
  EXPECT_EQ(connectionHint(snapshot, "echo", 0), "");
  EXPECT_EQ(connectionHint(snapshot, "echo", 7),
            ": no router of this host has a remote with location 7");
  WindowView window;
  window.name = "echo";
  window.location = 2;
  window.pid = 77;
  window.processState = 'S';
  snapshot.servers.push_back(window);

  EXPECT_EQ(connectionHint(snapshot, "echo", 2), "");
  EXPECT_EQ(connectionHint(snapshot, "echo", 0), "; it runs at location 2: --location 2");
  EXPECT_EQ(connectionHint(snapshot, "other", 0), "");

  snapshot.servers.back().processState = 'T';
  EXPECT_EQ(connectionHint(snapshot, "echo", 2), " (its process 77 is stopped)");

  snapshot.servers.back().life = Life::dead;
  EXPECT_EQ(connectionHint(snapshot, "echo", 0), "");
}

}  // namespace
}  // namespace mpf::tools
