// SPDX-License-Identifier: MIT
#include "tools/report/top_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::tools {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

WindowView serverOf(std::uint64_t incarnation, const std::string& name, std::uint64_t received) {
  WindowView server;
  server.isServer = true;
  server.incarnation = incarnation;
  server.name = name;
  server.received = received;
  return server;
}

// In each second, one server receives 10 requests and the other 2000.
std::shared_ptr<const SnapshotDelta> lookAt(std::vector<std::string> names) {
  Snapshot was;
  Snapshot is;
  is.atNs = 1'000'000'000;
  std::uint64_t number = 0;
  for (const auto& name : names) {
    ++number;
    was.servers.push_back(serverOf(number, name, 0));
    is.servers.push_back(serverOf(number, name, number == 1 ? 10 : 2000));
  }
  return std::make_shared<const SnapshotDelta>(std::move(was), std::move(is));
}

class TopViewTest : public testing::Test {
 protected:
  TopViewTest() { view_.show(lookAt({"beta", "alpha"})); }
  [[nodiscard]] std::string row(std::size_t number) const {
    return view_.lines(24).at(2 + number).text;
  }
  [[nodiscard]] std::string selected() const {
    for (const auto& line : view_.lines(24)) {
      if (line.style == TopLine::Style::selected) return line.text;
    }
    return {};
  }
  void press(std::initializer_list<int> keys) {
    for (const int key : keys) EXPECT_TRUE(view_.handle(key));
  }
  TopView view_;
};

TEST_F(TopViewTest, SortsTextsUpwardsAndNumbersDownwards) {
  EXPECT_THAT(row(0), StartsWith("alpha"));

  ASSERT_TRUE(view_.trySortBy("REQ/s"));
  EXPECT_THAT(row(0), HasSubstr(" 2000 "));

  press({'r'});
  EXPECT_THAT(row(0), HasSubstr(" 10 "));
}

TEST_F(TopViewTest, KeepsTheSelectionWhenTheOrderChanges) {
  press({'j'});
  EXPECT_THAT(selected(), StartsWith("beta"));

  press({'r'});
  EXPECT_THAT(selected(), StartsWith("beta"));
  EXPECT_THAT(row(0), StartsWith("beta"));
}

TEST_F(TopViewTest, SelectsTheNextRowWhenTheSelectedOneDisappears) {
  press({'j'});

  Snapshot snapshot;
  snapshot.servers.push_back(serverOf(2, "alpha", 0));
  view_.show(std::make_shared<const SnapshotDelta>(snapshot, snapshot));

  EXPECT_THAT(selected(), StartsWith("alpha"));
}

TEST_F(TopViewTest, ShowsOnlyLinesThatFit) {
  std::vector<std::string> names;
  for (int i = 100; i < 200; ++i) names.push_back("server" + std::to_string(i));
  view_.show(lookAt(names));

  EXPECT_EQ(view_.lines(24).size(), 24U);
  EXPECT_EQ(view_.lines(0).size(), 102U);

  for (int i = 0; i < 30; ++i) press({kTopPageDown});
  EXPECT_THAT(selected(), StartsWith("server199"));
}

TEST_F(TopViewTest, FitsInto80ColumnsWithUsualNames) {
  view_.show(lookAt({"a name of quite a lot of characters", "powersupply[12]"}));

  for (const auto& line : view_.lines(24)) EXPECT_LE(line.text.size(), 80U) << line.text;
  EXPECT_THAT(row(0), HasSubstr("~"));
}

TEST_F(TopViewTest, ReportsThatTheOpenedRowNoLongerExists) {
  press({kTopEnter});

  view_.show(lookAt({}));

  EXPECT_EQ(view_.lines(24).at(1).text, "GONE: server alpha, alive; Esc goes back");
  press({kTopBack, kTopEnter, 's'});
}

TEST_F(TopViewTest, ShowsTheTitleOfTheOpenedRow) {
  press({kTopEnter});
  EXPECT_EQ(view_.lines(24).at(0).text, "mpf top  : server alpha, alive");

  press({kTopBack});
  EXPECT_EQ(view_.lines(24).at(0).text,
            "mpf top  : 2 servers, 0 clients, 0 links, 2010 requests/s");
}

TEST_F(TopViewTest, AnAlarmRowStaysRedWhenSelected) {
  auto dead = serverOf(2, "alpha", 0);
  dead.life = Life::dead;
  Snapshot snapshot;
  snapshot.servers = {dead, serverOf(1, "beta", 0)};
  view_.show(std::make_shared<const SnapshotDelta>(snapshot, snapshot));
  EXPECT_EQ(view_.lines(24).at(2).style, TopLine::Style::selectedAlarm);

  press({'j'});

  EXPECT_EQ(view_.lines(24).at(2).style, TopLine::Style::alarm);
  EXPECT_EQ(view_.lines(24).at(3).style, TopLine::Style::selected);
}

TEST_F(TopViewTest, HelpListsKeysAndColumns) {
  press({'j', '?'});

  std::string help;
  for (const auto& line : view_.lines(40)) {
    EXPECT_LE(line.text.size(), 80U) << line.text;
    help += line.text + '\n';
  }
  for (const auto* word : {"Tab", "Esc", "QUEUE99", "RTT"}) EXPECT_THAT(help, HasSubstr(word));

  press({'?', kTopEnter, kTopBack});
  EXPECT_THAT(selected(), StartsWith("beta"));
}

// A router that is connected to one peer and not to another one.
std::shared_ptr<const SnapshotDelta> lookAtRouter() {
  RouterLineView up;
  up.row = 1;
  up.role = layout::RouterRole::client;
  up.state = layout::RouterLineState::connected;
  up.peer = "ioc1";
  up.address = "10.0.0.7:9900";
  up.program = "mpf-router 0.1.0";
  up.locations = "1, 2";
  up.clients = 4;
  up.bindings = 1;
  up.connects = 2;
  up.inQueue = 7;
  up.queueSize = 100;
  up.roundTripNs = 81'200;
  RouterLineView down;
  down.row = 0;
  down.role = layout::RouterRole::client;
  down.state = layout::RouterLineState::waiting;
  down.address = "ioc2.lab.example:9900";
  down.problem =
      "a reason of so many words that it does not fit into one line of a terminal, beside what it "
      "is called";
  RouterView router;
  router.incarnation = 77;
  router.name = "lab1";
  router.lines = {up, down};
  Snapshot was;
  was.routers = {router};
  auto is = was;
  is.atNs = 1'000'000'000;
  is.routers.front().lines.front().messagesSent = 500;
  is.routers.front().lines.front().framesSent = 50;
  return std::make_shared<const SnapshotDelta>(std::move(was), std::move(is));
}

TEST_F(TopViewTest, ShowsConnectionsToOtherHosts) {
  view_.show(lookAtRouter());

  press({kTopTab, kTopTab});

  const auto lines = view_.lines(24);
  EXPECT_THAT(lines.at(0).text, HasSubstr(": 1 of 2 connections cut, 0 servers"));
  EXPECT_THAT(
      lines.at(1).text,
      testing::MatchesRegex("ROUTER\\* +STATE +CONN +QUEUED +SENT/s +RECV/s +WRITES/s +RTT"));
  EXPECT_THAT(lines.at(2).text,
              testing::MatchesRegex("→ ioc1 +connected +4 +7 +500 +0 +50 +81.2 us"));
  EXPECT_THAT(lines.at(3).text,
              testing::MatchesRegex("→ ioc2.lab.exam~ +waiting +0 +0 +0 +0 +0 +-"));
  EXPECT_EQ(lines.at(2).style, TopLine::Style::selected);
  EXPECT_EQ(lines.at(3).style, TopLine::Style::alarm) << "a lost connection is red";
  // An arrow has three bytes.
  for (const auto& line : lines) EXPECT_LE(line.text.size(), 82U) << line.text;
  press({kTopTab});
  EXPECT_THAT(view_.lines(24).at(1).text, StartsWith("SERVER"));
}

TEST_F(TopViewTest, OpensAConnection) {
  view_.show(lookAtRouter());
  press({kTopTab, kTopTab, kTopEnter});

  std::string facts;
  for (const auto& line : view_.lines(24)) facts += line.text + '\n';
  EXPECT_THAT(facts, StartsWith("mpf top  : router → ioc1, connected\n"));
  for (const auto* fact : {"ioc1, mpf-router 0.1.0\n", "10.0.0.7:9900, plain TCP\n", "1, 2\n",
                           "connected   2 times\n", "81.2 us\n", "4, of 1 server\n",
                           "7 of 100 wait; full 0 times\n", "500 sent, 500/s; 0 received, 0/s\n"}) {
    EXPECT_THAT(facts, HasSubstr(fact));
  }

  press({kTopBack, 'j', kTopEnter});
  for (const auto& line : view_.lines(24)) EXPECT_LE(line.text.size(), 82U) << line.text;
  EXPECT_THAT(view_.lines(24).at(3).text, StartsWith("problem     a reason of so many words"));
  EXPECT_THAT(view_.lines(24).at(4).text, StartsWith("            of a terminal"));

  view_.show(lookAt({}));
  EXPECT_EQ(view_.lines(24).at(1).text,
            "GONE: router → ioc2.lab.example:9900, waiting; Esc goes back");
}

TEST_F(TopViewTest, QEndsTheProgramExceptInAFilter) {
  press({'/', 'q', kTopErase, 'b', kTopEnter});

  EXPECT_THAT(row(0), StartsWith("beta"));
  EXPECT_FALSE(view_.handle('q'));
}

}  // namespace
}  // namespace mpf::tools
