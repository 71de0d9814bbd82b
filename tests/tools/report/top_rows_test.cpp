// SPDX-License-Identifier: MIT
// The tables of `mpf top`, from hand-made snapshots.
#include "tools/report/top_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tools/report/latencies.h"
#include "tests/tools/report/views.h"

namespace mpf::tools {
namespace {

using test::kHalfASecond;
using testing::ElementsAre;

std::vector<std::string> textsOf(const TopRow& row) {
  std::vector<std::string> texts;
  for (const auto& cell : row.cells) texts.push_back(cell.text);
  return texts;
}

// The second cell of the row whose first cell is `name`; of several such rows, the first.
std::string factOf(const TopTable& table, const std::string& name) {
  for (const auto& row : table.rows) {
    if (row.cells.at(0).text == name) return row.cells.at(1).text;
  }
  return "no row " + name;
}

// Requests waiting, unanswered and refused on the link that the tests use.
LinkView busyLink() {
  auto link = test::linkView(7, {10, 8}, {6, 6});
  link.server = "dac";
  link.location = 2;
  link.queueSize = 32;
  link.clientState = layout::LinkState::open;
  link.serverState = layout::LinkState::open;
  link.unanswered = 4;
  link.refused = 3;
  link.bytes = 8192;
  return link;
}

WindowView topServer(std::uint64_t received) {
  auto view = test::serverView(received, 0, {busyLink()});
  view.name = "dac";
  view.location = 2;
  return view;
}

WindowView topClient() {
  auto view = test::clientView(0, {busyLink()});
  view.name = "mpf";
  view.pid = 17;
  return view;
}

TEST(TopRows, AServerHasItsLoadAndItsLatencies) {
  auto before = topServer(100);
  before.service = test::latencies({{1'000'000, 1000}});
  auto now = topServer(300);
  now.queueWait = test::latencies({{5000, 1}});
  now.service = test::latencies({{1'000'000, 1000}, {2000, 98}, {50'000, 2}});
  const SnapshotDelta delta(test::snapshotOf(0, {before}), test::snapshotOf(kHalfASecond, {now}));

  const auto table = topServers(delta);

  EXPECT_THAT(table.headings, ElementsAre("SERVER", "STATE", ">CONN", ">QUEUED", ">REQ/s",
                                          ">QUEUE99", ">SERVE50", ">SERVE99"));
  ASSERT_EQ(table.rows.size(), 1U);
  EXPECT_EQ(table.rows.front().id, test::kServer);
  EXPECT_FALSE(table.rows.front().isAlarm);
  // The samples before the first snapshot do not count.
  EXPECT_THAT(textsOf(table.rows.front()),
              ElementsAre("dac@2", "alive", "1", "2", "400", "5000 ns", "2048 ns", "57.3 us"));
  EXPECT_EQ(table.rows.front().cells.at(4).number, 400);
  EXPECT_EQ(table.rows.front().cells.at(6).number, 2048);
}

TEST(TopRows, AServerThatIsNewHasAllItsSamplesAndNoRates) {
  auto now = topServer(300);
  now.service = test::latencies({{2000, 1}});
  const SnapshotDelta delta(test::snapshotOf(0, {}), test::snapshotOf(kHalfASecond, {now}));

  EXPECT_THAT(textsOf(topServers(delta).rows.front()),
              ElementsAre("dac@2", "alive", "1", "2", "0", "-", "2000 ns", "2000 ns"));
}

TEST(TopRows, AClientHasItsRequestsAndItsReplyTimes) {
  auto now = topClient();
  now.links.front().requests.sent += 50;
  now.service = test::latencies({{100'000, 1}});
  const SnapshotDelta delta(test::snapshotOf(0, {}, {topClient()}),
                            test::snapshotOf(kHalfASecond, {}, {now}));

  EXPECT_THAT(textsOf(topClients(delta).rows.front()),
              ElementsAre("mpf", "alive", "17", "1", "4", "3", "100", "100.0 us", "100.0 us"));
}

// A name that is too long for its column is cut, so that the columns after it stay visible.
TEST(TopRows, LongNamesAreCut) {
  auto now = topServer(0);
  now.name = "a server with a long name";
  const SnapshotDelta delta(test::snapshotOf(0, {}), test::snapshotOf(1, {now}));

  EXPECT_EQ(topServers(delta).rows.front().cells.front().text, "a server with a~");
}

bool isAlarm(const WindowView& before, const WindowView& now) {
  const SnapshotDelta delta(test::snapshotOf(0, {before}), test::snapshotOf(kHalfASecond, {now}));
  return topServers(delta).rows.front().isAlarm;
}

TEST(TopRows, AServerThatIsStoppedDeadOrStalledIsAnAlarm) {
  auto now = topServer(5);
  EXPECT_TRUE(isAlarm(topServer(5), now)) << "stalled";
  EXPECT_FALSE(isAlarm(topServer(4), now)) << "alive";
  now.life = Life::closed;
  EXPECT_FALSE(isAlarm(topServer(4), now)) << "closed";
  now.life = Life::dead;
  EXPECT_TRUE(isAlarm(topServer(4), now)) << "dead";
  now.life = Life::alive;
  now.processState = 'T';
  EXPECT_TRUE(isAlarm(topServer(4), now)) << "stopped";
}

// A busy server is an alarm only if other requests wait.
TEST(TopRows, ABusyServerIsAnAlarmWhileRequestsWait) {
  auto busy = topServer(5);
  busy.handling = Handling{};
  EXPECT_TRUE(isAlarm(busy, busy));

  busy.links.front().requests = {10, 10};
  EXPECT_FALSE(isAlarm(busy, busy));
}

TEST(TopRows, TheLinksOfAServerNameItsClients) {
  const SnapshotDelta delta(test::snapshotOf(0, {topServer(0)}, {topClient()}),
                            test::snapshotOf(kHalfASecond, {topServer(1)}, {topClient()}));

  const auto ofServer = topLinks(delta, delta.now().servers.front());
  const auto ofClient = topLinks(delta, delta.now().clients.front());

  EXPECT_EQ(ofServer.headings.front(), "CLIENT");
  EXPECT_EQ(ofServer.rows.front().id, 7U);
  EXPECT_THAT(textsOf(ofServer.rows.front()),
              ElementsAre("mpf[17]", "alive", "open", "2", "4", "3", "0", "0", "8192"));
  EXPECT_EQ(ofClient.headings.front(), "SERVER");
  EXPECT_THAT(textsOf(ofClient.rows.front()),
              ElementsAre("dac@2", "alive", "open", "2", "4", "3", "0", "0", "8192"));
}

TEST(TopRows, ALinkOfAClientThatIsGoneIsAnAlarm) {
  const SnapshotDelta delta(test::snapshotOf(0, {}), test::snapshotOf(1, {topServer(0)}));

  const auto row = topLinks(delta, delta.now().servers.front()).rows.front();

  EXPECT_TRUE(row.isAlarm);
  EXPECT_EQ(row.cells.at(0).text, "?");
  EXPECT_EQ(row.cells.at(1).text, "gone");
}

TEST(TopRows, ARefusedLinkIsAnAlarm) {
  auto now = topServer(0);
  now.links.front().serverState = layout::LinkState::refused;
  const SnapshotDelta delta(test::snapshotOf(0, {}), test::snapshotOf(1, {now}, {topClient()}));

  const auto row = topLinks(delta, delta.now().servers.front()).rows.front();

  EXPECT_TRUE(row.isAlarm);
  EXPECT_EQ(row.cells.at(2).text, "refused");
}

TEST(TopRows, TheDetailsOfALinkAreFacts) {
  auto now = topServer(1);
  now.links.front().requests.sent = 20;
  const SnapshotDelta delta(test::snapshotOf(0, {topServer(0)}, {topClient()}),
                            test::snapshotOf(kHalfASecond, {now}, {topClient()}));

  const auto table = topLink(delta, delta.now().servers.front().links.front());

  EXPECT_EQ(factOf(table, "server"), "dac@2, alive");
  EXPECT_EQ(factOf(table, "client"), "mpf[17], alive");
  EXPECT_EQ(factOf(table, "link"), "open");
  EXPECT_EQ(factOf(table, "queue"), "12 of 32 wait");
  EXPECT_EQ(factOf(table, "requests"), "20 sent, 8 taken, 20/s");
  EXPECT_EQ(factOf(table, "replies"), "6 sent, 6 taken, 0/s");
  EXPECT_EQ(factOf(table, "unanswered"), "4");
  EXPECT_EQ(factOf(table, "refused sends"), "3");
  EXPECT_EQ(factOf(table, "shared memory"), "8192 bytes");
  EXPECT_EQ(factOf(table, "incarnation"), "7");
}

// A snapshot of a router with one connection to a remote.
Snapshot routerAt(std::int64_t atNs, std::uint64_t frames, const RouterLineView& line) {
  auto made = test::snapshotOf(atNs, {});
  RouterView router;
  router.incarnation = 0x500;
  router.name = "lab1";
  router.owner.pid = 55;
  router.processState = 'S';
  router.lines = {line};
  router.lines.front().framesSent = frames;
  made.routers = {router};
  return made;
}

RouterLineView topRemote() {
  RouterLineView line;
  line.row = 3;
  line.role = layout::RouterRole::client;
  line.state = layout::RouterLineState::connected;
  line.address = "10.0.0.7:9900";
  line.peer = "ioc1";
  line.program = "mpf-router 1.2";
  line.clients = 4;
  line.bindings = 1;
  line.inQueue = 6;
  line.queueSize = 100;
  line.queueFull = 2;
  line.roundTripNs = 81'200;
  line.connects = 3;
  return line;
}

TEST(TopRows, AConnectionHasItsLoadAndItsDirection) {
  const SnapshotDelta delta(routerAt(0, 10, topRemote()), routerAt(kHalfASecond, 60, topRemote()));

  const auto row = topRouters(delta).rows.front();

  EXPECT_EQ(row.id, topId(delta.now().routers.front(), delta.now().routers.front().lines.front()));
  EXPECT_FALSE(row.isAlarm);
  EXPECT_THAT(textsOf(row),
              ElementsAre("→ ioc1", "connected", "4", "6", "0", "0", "100", "81.2 us"));
}

TEST(TopRows, ACallerWithoutANameIsShownByItsAddress) {
  auto line = topRemote();
  line.role = layout::RouterRole::server;
  line.state = layout::RouterLineState::connecting;
  line.peer.clear();
  line.roundTripNs = 0;
  const SnapshotDelta delta(routerAt(0, 0, line), routerAt(1, 0, line));

  const auto row = topRouters(delta).rows.front();

  EXPECT_TRUE(row.isAlarm);
  EXPECT_EQ(row.cells.front().text, "← 10.0.0.7:9900");
  EXPECT_EQ(row.cells.back().text, "-");
}

TEST(TopRows, ConnectionsHaveDifferentIds) {
  RouterView router;
  router.incarnation = 0x500;
  RouterLineView first;
  RouterLineView second;
  second.row = 1;

  EXPECT_NE(topId(router, first), topId(router, second));
  EXPECT_NE(topId(router, first), router.incarnation);
}

TEST(TopRows, TheDetailsOfAConnectionAreFacts) {
  auto line = topRemote();
  line.sinceNs = 1'000'000'000;
  line.isTls = true;
  line.locations = "1, 2";
  const SnapshotDelta delta(routerAt(0, 0, line), routerAt(3'000'000'000, 30, line));
  const auto& router = delta.now().routers.front();

  const auto table = topLine(delta, router, router.lines.front());

  EXPECT_EQ(factOf(table, "state"), "connected for 2.0 s");
  EXPECT_EQ(factOf(table, "problem"), "no row problem");
  EXPECT_EQ(factOf(table, "peer"), "ioc1, mpf-router 1.2");
  EXPECT_EQ(factOf(table, "address"), "10.0.0.7:9900, TLS");
  EXPECT_EQ(factOf(table, "locations"), "1, 2");
  EXPECT_EQ(factOf(table, "connected"), "3 times");
  EXPECT_EQ(factOf(table, "round trip"), "81.2 us");
  EXPECT_EQ(factOf(table, "clients"), "4, of 1 server");
  EXPECT_EQ(factOf(table, "queue"), "6 of 100 wait; full 2 times");
  EXPECT_EQ(factOf(table, "frames"), "30 sent, 10/s; 0 received, 0/s");
  EXPECT_EQ(factOf(table, "router"), "lab1[55], alive");
}

// A long reason continues in rows without a name.
TEST(TopRows, ALongProblemHasSeveralRows) {
  auto line = topRemote();
  line.state = layout::RouterLineState::waiting;
  line.peer.clear();
  for (int i = 0; i < 20; ++i) line.problem += "reason ";
  const SnapshotDelta delta(routerAt(0, 0, line), routerAt(1, 0, line));
  const auto& router = delta.now().routers.front();

  const auto table = topLine(delta, router, router.lines.front());

  EXPECT_EQ(table.rows.at(1).cells.at(0).text, "problem");
  EXPECT_EQ(table.rows.at(2).cells.at(0).text, "");
  std::string whole;
  for (std::size_t i = 1; i <= 3; ++i) whole += table.rows.at(i).cells.at(1).text + " ";
  EXPECT_EQ(whole, line.problem);
  EXPECT_EQ(factOf(table, "peer"), "unknown");
}

TEST(TopTitle, NamesTheRowThatWasOpened) {
  const SnapshotDelta delta(test::snapshotOf(0, {}),
                            test::snapshotOf(1, {topServer(0)}, {topClient()}));
  EXPECT_EQ(topTitle(delta, delta.now().servers.front()), "server dac@2, alive");
  EXPECT_EQ(topTitle(delta, delta.now().clients.front()), "client mpf[17], alive");
  EXPECT_EQ(topTitle(delta, delta.now().clients.front().links.front()), "dac@2 <- mpf[17]");

  const SnapshotDelta routers(routerAt(0, 0, topRemote()), routerAt(1, 0, topRemote()));
  const auto& router = routers.now().routers.front();
  EXPECT_EQ(topTitle(routers, router, router.lines.front()), "router → ioc1, connected");
}

}  // namespace
}  // namespace mpf::tools
