// SPDX-License-Identifier: MIT
// ls, mrr, msr, inspect, clean: connections of a router. The test itself writes the router's rows.
#include <sys/wait.h>

#include <algorithm>
#include <fstream>

#include "shm/segment_name.h"
#include "tests/tools/report/router_rows.h"
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing::Not;
using testing::SizeIs;

// The columns of a text, in which each character has one column.
std::size_t columnsOf(const std::string& line) {
  return static_cast<std::size_t>(std::ranges::count_if(
      line, [](char c) { return (static_cast<unsigned char>(c) & 0xc0u) != 0x80u; }));
}

auto fitsInto80Columns() { return testing::ResultOf("columns", columnsOf, testing::Le(80u)); }

class RouterReportTest : public ToolsTest {
 protected:
  // Clients of this process that are connected to this server or wait for it.
  void bind(const std::string& server, std::int32_t location, int times = 1) {
    for (int i = 0; i < times; ++i) {
      clients_.push_back(std::make_unique<MessageClient>(dispatcher_, [](const Message&) {}));
      clients_.back()->bind(server, location);
    }
  }
  void awaitConnected() const {
    for (const auto& client : clients_) ASSERT_TRUE(client->connectWait(60s));
  }
  void awaitPendingBinds(std::size_t pendingBinds) {
    while (ls().at("waiting").size() != pendingBinds) dispatcher_.runOnce(Deadline::after(1ms));
  }
  [[nodiscard]] std::vector<std::string> mrr() const {
    return linesOf(run({"mrr", "--interval", "1ms"}).out);
  }
  static std::string us() { return "[" + std::to_string(::getpid()) + "]"; }

  Dispatcher dispatcher_{backplane_, {WaitMode::adaptive, "us"}};
  std::vector<std::unique_ptr<MessageClient>> clients_;
  router::Statistics statistics_{backplane_, "lab1"};

  void TearDown() override {}  // the segments of this test still exist
};

// The lines of the manual, "Diagnostic Aids", followed by new lines.
TEST_F(RouterReportTest, MrrShowsAClientRouterAsTheManualDoes) {
  const auto remote = connectedRemote(statistics_, {1, 2});
  const EchoThread proxy(backplane_, "Int32", {.location = 1});
  bind("Int32", 1, 4);
  awaitConnected();
  bind("serial[0]", 2, 2);
  awaitPendingBinds(2);

  const auto lines = mrr();

  const auto at = std::ranges::find(
      lines, " 2 RMRClient stateConnected queueSize 100 inQueue 7 sendQueueFull 2");
  ASSERT_EQ(lines.end() - at, 9) << testing::PrintToString(lines);
  EXPECT_THAT(
      std::vector(at + 1, lines.end()),
      ElementsAre(
          "   Server Int32@1 has 4 clients. bindState connected",
          "   Server serial[0]@2 has 2 clients. bindState waiting for the server",
          "   sendPerSec 0 receivePerSec 0  tcpSendPerSec 0 tcpReceivePerSec 0",
          "   sendBytesPerSec 0 receiveBytesPerSec 0",
          MatchesRegex("   roundTrip 81.2 us connectedFor [0-9.]+ [mun]?s reconnects 2 clients 4"),
          "   peer ioc1 (mpf-router 0.1.0) address 10.0.0.7:9900 plain locations 1, 2",
          "   router lab1" + us(), "serverRouterList"));
  EXPECT_THAT(lines, Each(fitsInto80Columns()));
}

TEST_F(RouterReportTest, MrrShowsAServerRouterAsTheManualDoes) {
  const auto caller = connectedCaller(statistics_);
  const EchoThread echo(backplane_, "Int32");
  Dispatcher far(backplane_, {WaitMode::block, "router ioc2"});
  MessageClient first(far, [](const Message&) {});
  MessageClient second(far, [](const Message&) {});
  for (auto* client : {&first, &second}) client->bind("Int32", 0);
  for (auto* client : {&first, &second}) ASSERT_TRUE(client->connectWait(60s));

  const auto lines = mrr();

  const auto at = std::ranges::find(
      lines, " 2 RMRServer stateConnected queueSize 100 inQueue 0 replyQueueFull 0");
  ASSERT_EQ(lines.end() - at, 7) << testing::PrintToString(lines);
  EXPECT_THAT(
      std::vector(at + 1, lines.end()),
      ElementsAre("   Server Int32 has 2 clients. bindState connected",
                  "   sendPerSec 0 receivePerSec 0  tcpSendPerSec 0 tcpReceivePerSec 0",
                  "   sendBytesPerSec 0 receiveBytesPerSec 0",
                  MatchesRegex("   roundTrip unknown connectedFor [0-9.]+ [mun]?s clients 2"),
                  "   peer ioc2 (mpf-router 0.2.0) address 10.0.0.9:51234 tls",
                  "   router lab1" + us()));
  EXPECT_THAT(testing::PrintToString(lines), Not(HasSubstr("router ioc2[")))
      << "shown with its connection";
}

// A router does not change the rows of local clients and servers.
TEST_F(RouterReportTest, LocalRowsDoNotChange) {
  const EchoThread local(backplane_, "local");
  bind("local", 0);
  awaitConnected();
  const auto before = mrr();

  const auto remote = connectedRemote(statistics_, {1});
  const auto after = mrr();

  EXPECT_THAT(before, testing::Contains(testing::StartsWith(" 1 local[")));
  EXPECT_GT(after.size(), before.size());
  auto at = after.begin();
  for (const auto& line : before) {  // in the same order
    at = std::find(at, after.end(), line);
    ASSERT_NE(at, after.end()) << line << testing::PrintToString(after);
    ++at;
  }
}

TEST_F(RouterReportTest, MrrShowsWhyThereIsNoConnection) {
  const auto lost = lostRemote(statistics_,
                               "no route to host, and so many other words that they do not fit "
                               "into a line of eighty columns");

  const auto lines = mrr();

  const auto at =
      std::ranges::find(lines, " 2 RMRClient stateWaiting queueSize 0 inQueue 0 sendQueueFull 0");
  ASSERT_NE(at, lines.end()) << testing::PrintToString(lines);
  EXPECT_THAT(
      *(at + 3),
      MatchesRegex("   roundTrip unknown notConnectedFor [0-9.]+ [mun]?s reconnects 0 clients 0"));
  EXPECT_THAT(
      std::vector(at + 4, at + 8),
      ElementsAre(
          "   peer unknown address 10.0.0.8:9900 plain locations 8", "   router lab1" + us(),
          "   problem no route to host, and so many other words that they do not fit into a",
          "     line of eighty columns"));
}

TEST_F(RouterReportTest, RatesAreThoseBetweenTheSnapshots) {
  const auto remote = connectedRemote(statistics_, {1});
  std::jthread traffic([&](const std::stop_token& stop) {
    for (std::uint64_t i = 1'000'000'000; !stop.stop_requested(); i += 1'000'000'000) {
      for (auto* word :
           {&(*remote)->messagesSent, &(*remote)->messagesReceived, &(*remote)->framesSent,
            &(*remote)->framesReceived, &(*remote)->bytesSent, &(*remote)->bytesReceived}) {
        set(*word, i);
      }
      std::this_thread::yield();
    }
  });
  const auto line = [&] { return ls().at("routers").at(0).at("lines").at(0); };

  for (const auto* rate : {"sent_per_s", "received_per_s", "frames_sent_per_s",
                           "frames_received_per_s", "bytes_sent_per_s", "bytes_received_per_s"}) {
    while (line().at(rate) == 0) continue;
  }

  // Long numbers do not exceed the line.
  EXPECT_THAT(mrr(), Each(fitsInto80Columns()));
}

TEST_F(RouterReportTest, LsShowsServersOnOtherHosts) {
  const auto remote = connectedRemote(statistics_, {1});
  const auto lost = lostRemote(statistics_);
  const auto caller = connectedCaller(statistics_);
  const EchoThread local(backplane_, "Int32");
  const EchoThread proxy(backplane_, "Int32", {.location = 1});

  const auto lines = linesOf(run({"ls"}).out);

  const auto pid = std::to_string(::getpid());
  EXPECT_THAT(
      lines,
      ElementsAre(
          "backplane " + backplane_.name(),
          MatchesRegex("  SERVER +STATE +PID +PROGRAM +CONN +QUEUED +TAKEN +AGE"),
          MatchesRegex("  Int32 +alive +" + pid + " +tools_test +0 +0 +0 +[0-9.]+ [mun]?s"),
          MatchesRegex("  Int32@1 +alive +" + pid + " +→ ioc1 +0 +0 +0 +[0-9.]+ [mun]?s"),
          testing::_, testing::_, MatchesRegex("  ROUTER +STATE +CLIENTS +RTT +SINCE +PEER"),
          MatchesRegex(
              "  → 10.0.0.7:9900 +connected +4 +81.2 us +[0-9.]+ [mun]?s +ioc1, locations 1"),
          MatchesRegex("  → 10.0.0.8:9900 +waiting +0 +- +[0-9.]+ [mun]?s +locations 8:"),
          MatchesRegex(" +connect.*"), MatchesRegex(" +refused"),
          MatchesRegex("  ← 10.0.0.9:51234 +connected +2 +- +[0-9.]+ [mun]?s +ioc2")));
  EXPECT_THAT(lines, Each(fitsInto80Columns()));
}

TEST_F(RouterReportTest, MsrShowsTheRouterOfAServerOnAnotherHost) {
  const auto remote = connectedRemote(statistics_, {1});
  const EchoThread local(backplane_, "Int32");
  const EchoThread proxy(backplane_, "Int32", {.location = 1});

  const auto there = run({"msr", "Int32", "--location", "1"});
  const auto here = run({"msr", "Int32", "--location", "0"});

  EXPECT_THAT(
      there.out,
      HasSubstr("                via ioc1 at 10.0.0.7:9900, connected, round trip 81.2 us, router\n"
                "                    lab1" +
                us() + "\n"));
  EXPECT_THAT(here.out, Not(HasSubstr(" via ")));
  EXPECT_THAT(report({"msr", "Int32", "--location", "1"}), SizeIs(1));
  EXPECT_EQ(report({"msr", "Int32", "--location", "1"}).at(0).at("via"),
            (nlohmann::json{{"peer", "ioc1"}, {"address", "10.0.0.7:9900"}}));
  EXPECT_THAT(report({"msr", "Int32"}), SizeIs(2));
}

TEST_F(RouterReportTest, InspectShowsEachRowOfARouter) {
  const auto remote = connectedRemote(statistics_, {1, 2});
  const auto lost = lostRemote(statistics_, "no \x1b[2J route");

  const auto text = run({"inspect", "lab1"}).out;
  const auto json = report({"inspect", "lab1"});

  EXPECT_THAT(text, AllOf(ContainsRegex("^router [0-9a-f]+: alive\n"), HasSubstr("  name: lab1\n"),
                          HasSubstr("role client, state connected"), HasSubstr("peer ioc1"),
                          Not(HasSubstr("\x1b"))));
  ASSERT_THAT(json, SizeIs(1));
  EXPECT_EQ(json.at(0).at("kind"), "router");
  ASSERT_THAT(json.at(0).at("lines"), SizeIs(2));
  EXPECT_EQ(json.at(0).at("lines").at(0).at("locations"), "1, 2");
  EXPECT_EQ(json.at(0).at("lines").at(1).at("problem"), R"(no \x1b[2J route)");
}

TEST_F(RouterReportTest, TheSummaryOfInspectHasRoutersAndPendingBinds) {
  const auto remote = connectedRemote(statistics_, {1});
  const auto lost = lostRemote(statistics_);
  bind("dac", 8, 2);
  awaitPendingBinds(2);

  const auto text = run({"inspect"}).out;

  EXPECT_THAT(text, HasSubstr("  router lab1" + us() + ", alive: 2 connections, 1 of them cut\n"));
  EXPECT_THAT(text,
              HasSubstr("  us" + us() + " waits for the server dac@8, which is absent, 2 times\n"));
  const auto json = report({"inspect"}).at(0);
  EXPECT_EQ(json.at("routers").at(0).at("cut"), 1);
  EXPECT_EQ(entryOf(json.at("windows"), "name", "us").at("waits_for").at(0),
            (nlohmann::json{{"server", "dac"}, {"location", 8}}));
}

// The router is a process, which the test kills.
TEST_F(RouterReportTest, ReportsADeadRouterAndCleanRemovesIt) {
  auto segment =
      Segment::create(layout::kRouterBytes, layout::SegmentKind::router, backplane_.name(), {});
  std::string("gone").copy(segment.sharedHeader().name.data(), 4);
  auto& line = segment.at<layout::RouterLine>(layout::kRouterLinesOffset);
  line.role.store(layout::RouterRole::client, std::memory_order_relaxed);
  line.state.store(layout::RouterLineState::connected, std::memory_order_relaxed);
  const auto name =
      SegmentName::keyed(backplane_.name(), NameKind::router, segment.sharedHeader().incarnation);
  ASSERT_TRUE(segment.tryPublish(name));

  EXPECT_EQ(entryOf(ls().at("routers"), "name", "gone").at("state"), "dead");
  EXPECT_THAT(testing::PrintToString(mrr()), HasSubstr("RMRClient dead queueSize 0"));
  EXPECT_THAT(run({"clean", "--dry-run"}).out,
              HasSubstr("would remove " + segments::path(name) + ":\n"));
  EXPECT_THAT(run({"clean"}).out, HasSubstr("removed " + segments::path(name) + ":\n"));

  EXPECT_THAT(ls().at("routers"), SizeIs(1)) << "the router of the test is alive";
  EXPECT_THAT(backplane_.segmentNames(), Not(testing::Contains(name)));
}

TEST_F(RouterReportTest, EachJsonFieldIsDocumented) {
  const auto remote = connectedRemote(statistics_, {1});
  const EchoThread proxy(backplane_, "Int32", {.location = 1});
  std::ostringstream document;
  document << std::ifstream(MPF_TEST_TOOLS_MD).rdbuf();

  const auto all = ls();
  const auto inspected = report({"inspect", "lab1"}).at(0);

  for (const auto& object : {all.at("routers").at(0), all.at("routers").at(0).at("lines").at(0),
                             all.at("servers").at(0).at("via"), inspected.at("lines").at(0),
                             report({"inspect"}).at(0).at("routers").at(0)}) {
    for (const auto& [key, value] : object.items())
      EXPECT_NE(document.str().find("`" + key + "`"), std::string::npos) << key;
  }
}

TEST_F(RouterReportTest, ShowsAThousandClientsOfARouterInOneLine) {
  const auto remote = connectedRemote(statistics_, {1});
  const EchoThread proxy(backplane_, "echo", {.location = 1});
  bind("echo", 1, 1000);
  awaitConnected();
  bind("later", 1, 1000);
  awaitPendingBinds(1000);

  EXPECT_THAT(inOneLine(run({"ls"}).out),
              AllOf(HasSubstr("echo@1 x 1000"), HasSubstr("later@1 (waiting) x 1000")));
  const auto lines = mrr();
  EXPECT_THAT(lines,
              testing::Contains("   Server echo@1 has 1000 clients. bindState connected").Times(2))
      << "as a client, and as a router";
  EXPECT_THAT(lines, testing::Contains(
                         "   Server later@1 has 1000 clients. bindState waiting for the server")
                         .Times(2));
  EXPECT_LT(lines.size(), 24U);
}

}  // namespace
}  // namespace mpf::test
