// SPDX-License-Identifier: MIT
// The summary of a backplane, from hand-made snapshots.
#include "tools/inspect/inspect_summary.h"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tools/report/views.h"

namespace mpf::tools {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

WindowView named(WindowView window, const std::string& name, std::int32_t pid) {
  window.name = name;
  window.pid = pid;
  return window;
}

LinkView openLink(std::uint64_t incarnation, Traffic requests) {
  auto link = test::linkView(incarnation, requests);
  link.server = "dac";
  link.clientState = layout::LinkState::open;
  link.serverState = layout::LinkState::open;
  return link;
}

// A backplane on which a server has a waiting request on its second link.
Snapshot someBackplane() {
  const std::vector<LinkView> links{openLink(0xa, {5, 5}), openLink(0xb, {6, 5})};
  auto made = test::snapshotOf(1, {named(test::serverView(0, 0, links), "dac", 11)},
                               {named(test::clientView(0, links), "mpf", 12)});
  made.backplane = "lab";
  made.files = 5;
  made.bytes = 2048;
  return made;
}

SnapshotDelta at(Snapshot now) { return {test::snapshotOf(0, {}), std::move(now)}; }

TEST(InspectSummary, ListsALinkOfTwoWindowsOnce) {
  auto snapshot = someBackplane();
  auto orphan = openLink(0xc, {});
  snapshot.clients.front().links.push_back(orphan);

  const auto links = linksOf(snapshot);

  ASSERT_EQ(links.size(), 3U);
  EXPECT_EQ(links[0]->incarnation, 0xaU);
  EXPECT_EQ(links[1]->incarnation, 0xbU);
  EXPECT_EQ(links[2]->incarnation, 0xcU);
}

TEST(InspectSummary, TextHasTheWindowsAndTheLinksOnWhichAProcessWaits) {
  EXPECT_EQ(summaryText(at(someBackplane())),
            "backplane lab: 5 files, 2.0 KiB\n"
            "  WINDOW      STATE  PID  SLEEPS  LINKS  WAITING  READY  KNOCKS\n"
            "  server dac  alive   11  no          2        1      0       0\n"
            "  client mpf  alive   12  no          2        0      0       0\n"
            "  b                 dac <- mpf[12]\n"
            "    1 request waits for the server (awake, no ready bit)\n"
            "  1 of 2 links idle\n");
}

TEST(InspectSummary, AnEmptyBackplaneHasNoWindow) {
  auto empty = test::snapshotOf(1, {});
  empty.backplane = "lab";
  empty.problems = {"mpf.lab.x: a reason"};

  EXPECT_EQ(summaryText(at(empty)),
            "backplane lab: 0 files, 0 B\n  no window\n  problem: mpf.lab.x: a reason\n");
}

TEST(InspectSummary, NamesAClientThatWaitsForAnAbsentServerOnce) {
  auto snapshot = someBackplane();
  snapshot.clients.front().pendingBinds = {
      {test::kClient, "adc", 0}, {test::kClient, "later", 3}, {test::kClient, "later", 3}};

  const auto text = summaryText(at(snapshot));

  EXPECT_THAT(text, AllOf(HasSubstr("  mpf[12] waits for the server adc, which is absent\n"),
                          HasSubstr("  mpf[12] waits for the server later@3, which is absent, 2 "
                                    "times\n")));
}

TEST(InspectSummary, CountsTheConnectionsOfARouterThatAreCut) {
  auto snapshot = someBackplane();
  RouterView router;
  router.name = "ioc1";
  router.owner.pid = 99;
  router.lines.resize(3);
  router.lines[1].state = layout::RouterLineState::connected;
  snapshot.routers = {router};

  EXPECT_THAT(summaryText(at(snapshot)),
              HasSubstr("  router ioc1[99], alive: 3 connections, 2 of them cut\n"));
  EXPECT_EQ(summaryTree(at(snapshot)).at("routers").at(0).at("cut"), 2);
}

// Thirty rows of each kind; the tree has all.
TEST(InspectSummary, LimitsTheTextButNotTheTree) {
  Snapshot snapshot;
  for (std::uint64_t i = 0; i < 100; ++i) {
    auto server = named(test::serverView(0, 0, {openLink(1000 + i, {1, 0})}), "s", 11);
    server.incarnation = i + 1;
    snapshot.servers.push_back(server);
  }

  const auto text = summaryText(at(snapshot));
  const auto tree = summaryTree(at(snapshot));

  EXPECT_THAT(text, AllOf(HasSubstr("  and 70 windows more; --json shows all\n"),
                          HasSubstr("  and 70 links more; --json shows all\n"),
                          EndsWith("  0 of 100 links idle\n")));
  EXPECT_LT(std::ranges::count(text, '\n'), 100);
  EXPECT_EQ(tree.at("windows").size(), 100U);
  EXPECT_EQ(tree.at("links").size(), 100U);
}

TEST(InspectSummary, ALinkNamesAClientThatIsGone) {
  auto snapshot = someBackplane();
  snapshot.clients.clear();
  const auto delta = at(std::move(snapshot));

  const auto row = linkRow(delta, delta.now().servers.front().links.back());

  EXPECT_EQ(row.at("link"), "b");
  EXPECT_EQ(row.at("server"), "dac");
  EXPECT_EQ(row.at("client"), "gone");
  EXPECT_EQ(row.at("requests_waiting"), 1);
  EXPECT_EQ(row.at("waits"), "over: the client is gone");
}

TEST(InspectSummary, TheTreeHasTheHintsOfAWindow) {
  auto snapshot = someBackplane();
  auto& hints = snapshot.servers.front().hints;
  hints.bell = 8;
  hints.isRescanDue = true;
  hints.ready = {2, 300};
  hints.knocks = {0x77};
  snapshot.clients.front().pendingBinds = {{test::kClient, "later", 3}};

  const auto windows = summaryTree(at(std::move(snapshot))).at("windows");

  const auto& server = windows.at(0);
  EXPECT_EQ(server.at("kind"), "server");
  EXPECT_EQ(server.at("bell"), 8);
  EXPECT_EQ(server.at("rescan"), true);
  EXPECT_EQ(server.at("ready"), (Tree{2, 300}));
  EXPECT_EQ(server.at("knocks"), Tree{"77"});
  const auto& client = windows.at(1);
  EXPECT_EQ(client.at("kind"), "client");
  ASSERT_EQ(client.at("waits_for").size(), 1U);
  EXPECT_EQ(client.at("waits_for").at(0).at("server"), "later");
  EXPECT_EQ(client.at("waits_for").at(0).at("location"), 3);
}

TEST(LinkTable, HasAtMostTheRequestedLinks) {
  const auto delta = at(someBackplane());
  const auto links = linksOf(delta.now());

  EXPECT_THAT(linkTable(delta, links, 1),
              AllOf(StartsWith("  a                 dac <- mpf[12]\n    idle\n"),
                    EndsWith("  and 1 link more; --json shows all\n")));
  EXPECT_THAT(linkTable(delta, links, 2), Not(HasSubstr("more")));
}

}  // namespace
}  // namespace mpf::tools
