// SPDX-License-Identifier: MIT
// Which process waits for which, from hand-made snapshots.
#include "tools/inspect/waits.h"

#include <gtest/gtest.h>

#include "tests/tools/report/views.h"

namespace mpf::tools {
namespace {

using layout::LinkState;
using layout::SleepState;

// One link, which is open and idle until a test changes it, between a server and a client.
class WaitsTest : public testing::Test {
 protected:
  WaitsTest() {
    link_.clientState = LinkState::open;
    link_.serverState = LinkState::open;
    link_.serverIndex = 3;
    link_.clientIndex = 4;
  }
  [[nodiscard]] std::string waits() const {
    auto now = test::snapshotOf(test::kHalfASecond, {server_}, {client_});
    if (isServerGone_) now.servers.clear();
    if (isClientGone_) now.clients.clear();
    return waitsOf(SnapshotDelta(test::snapshotOf(0, {}, {}), std::move(now)), link_);
  }

  LinkView link_ = test::linkView(7, {5, 5}, {5, 5});
  WindowView server_ = test::serverView(5, 5);
  WindowView client_ = test::clientView(5);
  bool isServerGone_ = false;
  bool isClientGone_ = false;
};

TEST_F(WaitsTest, ALinkWithoutMessagesIsIdle) { EXPECT_EQ(waits(), kIdle); }

TEST_F(WaitsTest, RequestsWaitForTheServer) {
  link_.requests = {6, 5};
  server_.sleeping = SleepState::onFutex;
  EXPECT_EQ(waits(), "1 request waits for the server (asleep on its futex, no ready bit)");

  link_.requests = {8, 5};
  server_.hints.ready = {1, 3};
  EXPECT_EQ(waits(), "3 requests wait for the server (asleep on its futex, ready bit set)");

  link_.isPolledByServer = true;
  server_.sleeping = SleepState::awake;
  server_.processState = 'T';
  EXPECT_EQ(waits(), "3 requests wait for the server (stopped, awake, it polls)");
}

// The ready bits of the client are those of its own index.
TEST_F(WaitsTest, RepliesWaitForTheClient) {
  link_.replies = {7, 5};
  client_.sleeping = SleepState::onDescriptor;
  client_.hints.ready = {3};
  EXPECT_EQ(waits(), "2 replies wait for the client (asleep on its pipe, no ready bit)");

  client_.hints.ready = {4};
  EXPECT_EQ(waits(), "2 replies wait for the client (asleep on its pipe, ready bit set)");

  link_.replies = {6, 5};
  link_.isPolledByClient = true;
  EXPECT_EQ(waits(), "1 reply waits for the client (asleep on its pipe, it polls)");
}

TEST_F(WaitsTest, AStalledClientThatIsNotAsleepDoesNotPoll) {
  link_.replies = {52, 5};
  link_.isPolledByClient = true;
  client_.links = {link_};
  const SnapshotDelta delta(test::snapshotOf(0, {server_}, {client_}),
                            test::snapshotOf(test::kHalfASecond, {server_}, {client_}));

  EXPECT_EQ(waitsOf(delta, link_),
            "47 replies wait for the client (stalled, not asleep on its window)");
}

TEST_F(WaitsTest, BothDirectionsMayWait) {
  link_.requests = {6, 5};
  link_.replies = {6, 5};
  link_.unanswered = 9;

  EXPECT_EQ(waits(),
            "1 request waits for the server (awake, no ready bit); 1 reply waits for the client "
            "(awake, no ready bit)");
}

TEST_F(WaitsTest, TheClientWaitsForRepliesThatWereNotSent) {
  link_.unanswered = 1;
  EXPECT_EQ(waits(), "the client waits for 1 reply");

  link_.unanswered = 2;
  EXPECT_EQ(waits(), "the client waits for 2 replies");
}

TEST_F(WaitsTest, AClientWaitsUntilTheServerAcceptsIt) {
  link_.serverState = LinkState::none;
  link_.requests = {1, 0};
  EXPECT_EQ(waits(), "the client waits to be accepted (awake, no knock pending)");

  server_.hints.knocks = {link_.incarnation};
  EXPECT_EQ(waits(), "the client waits to be accepted (awake, knock pending)");
}

// A link that is over stays until it is removed. The text says first what ended it.
TEST_F(WaitsTest, ALinkIsOverWhenOneSideHasEnded) {
  link_.requests = {9, 0};
  link_.serverState = LinkState::refused;
  EXPECT_EQ(waits(), "over: refused by the server");
  link_.serverState = LinkState::closed;
  EXPECT_EQ(waits(), "over: closed by the server");
  link_.clientState = LinkState::closed;
  EXPECT_EQ(waits(), "over: closed by the client");
  server_.life = Life::dead;
  EXPECT_EQ(waits(), "over: the server is dead");
  client_.life = Life::dead;
  EXPECT_EQ(waits(), "over: the client is dead");
  isServerGone_ = true;
  EXPECT_EQ(waits(), "over: the server is gone");
  isClientGone_ = true;
  EXPECT_EQ(waits(), "over: the client is gone");
}

}  // namespace
}  // namespace mpf::tools
