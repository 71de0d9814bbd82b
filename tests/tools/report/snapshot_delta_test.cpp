// SPDX-License-Identifier: MIT
// SnapshotDelta: rates and stalls, from hand-made snapshots.
#include "tools/report/snapshot_delta.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tools/report/views.h"

namespace mpf::tools {
namespace {

using test::clientView;
using test::kClient;
using test::kHalfASecond;
using test::kServer;
using test::linkView;
using test::serverView;
using test::snapshotOf;

TEST(SnapshotDelta, RatesOfAServerAreWhatItReceivedAndSent) {
  const SnapshotDelta delta(snapshotOf(0, {serverView(100, 50)}),
                            snapshotOf(kHalfASecond, {serverView(200, 80)}));

  const auto rates = delta.ratesOf(delta.now().servers.front());

  EXPECT_DOUBLE_EQ(rates.receivedPerSecond, 200);
  EXPECT_DOUBLE_EQ(rates.sentPerSecond, 60);
}

// The links of clients that connect and leave between two snapshots are not in either of them, but
// their requests count.
TEST(SnapshotDelta, RatesOfAServerIncludeClientsThatLeft) {
  const SnapshotDelta delta(
      snapshotOf(0, {serverView(100, 100, {linkView(7, {100, 100}, {100, 100})})}),
      snapshotOf(kHalfASecond, {serverView(130, 130)}));

  const auto rates = delta.ratesOf(delta.now().servers.front());

  EXPECT_DOUBLE_EQ(rates.receivedPerSecond, 60);
  EXPECT_DOUBLE_EQ(rates.sentPerSecond, 60);
}

TEST(SnapshotDelta, RatesOfAClientAreWhatItsLinksSentAndItReceived) {
  const SnapshotDelta delta(
      snapshotOf(0, {}, {clientView(10, {linkView(7, {10, 10}), linkView(8, {1000, 1000})})}),
      snapshotOf(kHalfASecond, {}, {clientView(15, {linkView(7, {20, 20}), linkView(9, {5, 5})})}));

  const auto rates = delta.ratesOf(delta.now().clients.front());

  EXPECT_DOUBLE_EQ(rates.sentPerSecond, 30);  // 10 on an old link, 5 on a new one; one was removed
  EXPECT_DOUBLE_EQ(rates.receivedPerSecond, 10);
}

TEST(SnapshotDelta, AWindowWithoutAnEarlierSnapshotHasNoRates) {
  const SnapshotDelta delta(snapshotOf(0, {}), snapshotOf(kHalfASecond, {serverView(100, 100)}));

  EXPECT_DOUBLE_EQ(delta.ratesOf(delta.now().servers.front()).receivedPerSecond, 0);
}

TEST(SnapshotDelta, DecreasingCountersAndEqualTimesGiveNoRates) {
  const SnapshotDelta back(snapshotOf(0, {serverView(100, 100)}),
                           snapshotOf(kHalfASecond, {serverView(10, 10)}));
  const SnapshotDelta standing(snapshotOf(5, {serverView(1, 1)}),
                               snapshotOf(5, {serverView(2, 2)}));

  EXPECT_DOUBLE_EQ(back.ratesOf(back.now().servers.front()).sentPerSecond, 0);
  EXPECT_DOUBLE_EQ(standing.ratesOf(standing.now().servers.front()).sentPerSecond, 0);
}

TEST(SnapshotDelta, FindsWindowsByTheirIncarnation) {
  const SnapshotDelta delta(snapshotOf(0, {}), snapshotOf(1, {serverView(0, 0)}, {clientView(0)}));

  EXPECT_EQ(delta.find(kServer), &delta.now().servers.front());
  EXPECT_EQ(delta.find(kClient), &delta.now().clients.front());
  EXPECT_EQ(delta.find(3), nullptr);
}

std::string serverState(const WindowView& before, const WindowView& now) {
  const SnapshotDelta delta(snapshotOf(0, {before}), snapshotOf(kHalfASecond, {now}));
  return delta.stateOf(delta.now().servers.front());
}

TEST(SnapshotDelta, AnIdleServerIsAlive) {
  EXPECT_EQ(
      serverState(serverView(5, 5, {linkView(7, {5, 5})}), serverView(5, 5, {linkView(7, {5, 5})})),
      "alive");
}

TEST(SnapshotDelta, AServerThatTakesNothingWhileRequestsWaitIsStalled) {
  EXPECT_EQ(
      serverState(serverView(5, 5, {linkView(7, {6, 5})}), serverView(5, 5, {linkView(7, {9, 5})})),
      "stalled");
}

TEST(SnapshotDelta, AServerThatReceivesIsAliveEvenIfMessagesWait) {
  EXPECT_EQ(serverState(serverView(5, 5, {linkView(7, {60, 5})}),
                        serverView(6, 6, {linkView(7, {60, 6})})),
            "alive");
}

TEST(SnapshotDelta, ARequestThatJustArrivedIsNotAStall) {
  EXPECT_EQ(
      serverState(serverView(5, 5, {linkView(7, {5, 5})}), serverView(5, 5, {linkView(7, {6, 5})})),
      "alive");
  EXPECT_EQ(
      serverState(serverView(5, 5, {linkView(7, {6, 5})}), serverView(5, 5, {linkView(7, {6, 6})})),
      "alive");
}

// The sums of the links decrease when another client leaves; the server is still stalled.
TEST(SnapshotDelta, AStalledServerStaysStalledWhenAClientLeaves) {
  EXPECT_EQ(serverState(serverView(9, 9, {linkView(7, {6, 5}), linkView(8, {4, 4})}),
                        serverView(9, 9, {linkView(7, {6, 5})})),
            "stalled");
}

TEST(SnapshotDelta, AClientThatDoesNotTakeItsRepliesIsStalled) {
  const auto stuck = clientView(2, {linkView(7, {5, 5}, {5, 2})});
  const SnapshotDelta delta(snapshotOf(0, {}, {stuck}), snapshotOf(kHalfASecond, {}, {stuck}));

  EXPECT_EQ(delta.stateOf(delta.now().clients.front()), "stalled");
}

TEST(SnapshotDelta, TheWorstStateIsReported) {
  const auto stuck = serverView(5, 5, {linkView(7, {6, 5})});
  auto stopped = stuck;
  stopped.processState = 'T';
  auto traced = stuck;
  traced.processState = 't';
  auto dead = stopped;
  dead.life = Life::dead;
  auto closed = stuck;
  closed.life = Life::closed;

  EXPECT_EQ(serverState(stuck, stopped), "stopped");
  EXPECT_EQ(serverState(stuck, traced), "stopped");
  EXPECT_EQ(serverState(stuck, dead), "dead");
  EXPECT_EQ(serverState(stuck, closed), "closed");
}

TEST(Totals, IncomingAreRequestsOfAServerAndRepliesOfAClient) {
  auto one = linkView(7, {10, 8}, {7, 6});
  one.refused = 1;
  one.unanswered = 2;
  one.bytes = 4096;
  const std::vector<LinkView> links{one, one};

  const auto ofServer = Totals::of(serverView(0, 0, links));
  const auto ofClient = Totals::of(clientView(0, links));

  EXPECT_EQ(ofServer.incoming.waiting(), 4U);
  EXPECT_EQ(ofServer.outgoing.waiting(), 2U);
  EXPECT_EQ(ofClient.incoming.waiting(), 2U);
  EXPECT_EQ(ofClient.outgoing.waiting(), 4U);
  EXPECT_EQ(ofServer.refused, 2U);
  EXPECT_EQ(ofServer.unanswered, 4U);
  EXPECT_EQ(ofServer.bytes, 8192U);
}

RouterView router(std::vector<RouterLineView> lines) {
  RouterView view;
  view.incarnation = 5;
  view.processState = 'S';
  view.lines = std::move(lines);
  return view;
}

RouterLineView line(const std::string& address, std::uint64_t count) {
  RouterLineView view;
  view.row = 3;
  view.role = layout::RouterRole::client;
  view.state = layout::RouterLineState::connected;
  view.address = address;
  view.messagesSent = count;
  view.messagesReceived = 2 * count;
  view.framesSent = 3 * count;
  view.framesReceived = 4 * count;
  view.bytesSent = 5 * count;
  view.bytesReceived = 6 * count;
  return view;
}

SnapshotDelta routersAt(const RouterView& before, const RouterView& now) {
  auto was = snapshotOf(0, {});
  auto is = snapshotOf(kHalfASecond, {});
  was.routers = {before};
  is.routers = {now};
  return {std::move(was), std::move(is)};
}

TEST(SnapshotDelta, RatesOfAConnectionAreMessagesFramesAndBytes) {
  const auto delta = routersAt(router({line("a", 100)}), router({line("a", 110)}));
  const auto& now = delta.now().routers.front();

  const auto rates = delta.ratesOf(now, now.lines.front());

  EXPECT_DOUBLE_EQ(rates.messages.sentPerSecond, 20);
  EXPECT_DOUBLE_EQ(rates.messages.receivedPerSecond, 40);
  EXPECT_DOUBLE_EQ(rates.frames.sentPerSecond, 60);
  EXPECT_DOUBLE_EQ(rates.frames.receivedPerSecond, 80);
  EXPECT_DOUBLE_EQ(rates.bytes.sentPerSecond, 100);
  EXPECT_DOUBLE_EQ(rates.bytes.receivedPerSecond, 120);
}

// A row is reused when its connection has ended.
TEST(SnapshotDelta, AnotherConnectionInTheSameRowHasNoRates) {
  const auto delta = routersAt(router({line("a", 100)}), router({line("b", 110)}));
  const auto& now = delta.now().routers.front();

  EXPECT_DOUBLE_EQ(delta.ratesOf(now, now.lines.front()).messages.sentPerSecond, 0);
}

TEST(SnapshotDelta, AConnectionHasTheStateOfADeadRouter) {
  auto view = router({line("a", 0)});
  const auto stateOf = [](const RouterView& now) {
    const auto delta = routersAt(now, now);
    return delta.stateOf(delta.now().routers.front(), delta.now().routers.front().lines.front());
  };

  EXPECT_EQ(stateOf(view), "connected");
  view.lines.front().state = layout::RouterLineState::connecting;
  EXPECT_EQ(stateOf(view), "connecting");
  view.processState = 'T';
  EXPECT_EQ(stateOf(view), "stopped");
  view.life = Life::dead;
  EXPECT_EQ(stateOf(view), "dead");
}

TEST(SnapshotDelta, AWindowOfARouterLeadsToItsConnection) {
  auto proxy = serverView(0, 0);
  proxy.router = 5;
  proxy.routerRow = 3;
  auto is = snapshotOf(1, {proxy, serverView(0, 0)});
  is.routers = {router({line("a", 0)})};
  const SnapshotDelta delta(snapshotOf(0, {}), std::move(is));

  EXPECT_EQ(delta.routerOf(delta.now().servers.front()).line,
            &delta.now().routers.front().lines.front());
  EXPECT_FALSE(delta.routerOf(delta.now().servers.back()));
}

}  // namespace
}  // namespace mpf::tools
