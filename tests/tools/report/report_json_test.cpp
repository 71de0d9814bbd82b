// SPDX-License-Identifier: MIT
// Reports as JSON, from hand-made snapshots.
#include "tools/report/report_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mpf/message_layout.h>

#include "tests/tools/report/latencies.h"
#include "tests/tools/report/views.h"

namespace mpf::tools {
namespace {

using nlohmann::json;
using test::kHalfASecond;

LinkView jsonLink() {
  auto link = test::linkView(7, {10, 8}, {6, 5});
  link.server = "dac";
  link.location = 2;
  link.queueSize = 32;
  link.clientState = layout::LinkState::open;
  link.serverState = layout::LinkState::refused;
  link.refused = 3;
  link.unanswered = 4;
  link.bytes = 8192;
  return link;
}

WindowView jsonClient() {
  auto client = test::clientView(0, {jsonLink()});
  client.name = "label";
  client.pid = 17;
  client.program = "mpf";
  return client;
}

TEST(ReportJson, AWindowHasItsRatesAndLatencies) {
  auto before = test::serverView(100, 50);
  auto now = test::serverView(200, 80);
  now.ageNs = 1'500'000'000;
  now.waitMode = 2;
  now.service = test::latencies({{1024, 50}, {5000, 49}, {100'000, 1}});
  const SnapshotDelta delta(test::snapshotOf(0, {before}), test::snapshotOf(kHalfASecond, {now}));

  const auto entry = toJson(delta, delta.now().servers.front());

  EXPECT_EQ(entry.at("state"), "alive");
  EXPECT_EQ(entry.at("age_s"), 1.5);
  EXPECT_EQ(entry.at("wait_mode"), "block");
  EXPECT_EQ(entry.at("received"), 200);
  EXPECT_EQ(entry.at("received_per_s"), 200.0);
  EXPECT_EQ(entry.at("sent_per_s"), 60.0);
  EXPECT_EQ(entry.at("service"), (json{{"count", 100},
                                       {"p50_ns", 1280},
                                       {"p99_ns", 5120},
                                       {"p999_ns", 100'000},
                                       {"max_ns", 100'000}}));
  EXPECT_EQ(entry.at("queue_wait").at("count"), 0);
}

TEST(ReportJson, OnlyAServerHasTheFieldsOfAServer) {
  auto server = test::serverView(0, 9);
  server.location = 3;
  server.maxMessageBytes = 12'345;
  const SnapshotDelta delta(test::snapshotOf(0, {}), test::snapshotOf(1, {server}, {jsonClient()}));

  const auto ofServer = toJson(delta, delta.now().servers.front());
  const auto ofClient = toJson(delta, delta.now().clients.front());

  EXPECT_EQ(ofServer.at("location"), 3);
  EXPECT_EQ(ofServer.at("replies"), 9);
  EXPECT_EQ(ofServer.at("max_message_bytes"), 12'345);
  for (const auto* field : {"location", "queue_size", "replies", "max_message_bytes"})
    EXPECT_FALSE(ofClient.contains(field)) << field;
}

// The peer is the process at the other end: for a client, its server.
TEST(ReportJson, ALinkNamesItsPeer) {
  auto server = test::serverView(0, 0, {jsonLink()});
  server.pid = 11;
  server.program = "mpf-dac";
  const SnapshotDelta delta(test::snapshotOf(0, {}), test::snapshotOf(1, {server}, {jsonClient()}));

  const auto ofServer = toJson(delta, delta.now().servers.front()).at("links").at(0);
  const auto ofClient = toJson(delta, delta.now().clients.front()).at("links").at(0);

  EXPECT_EQ(ofServer.at("peer_pid"), 17);
  EXPECT_EQ(ofServer.at("peer_program"), "mpf");
  EXPECT_EQ(ofClient.at("peer_pid"), 11);
  EXPECT_EQ(ofClient.at("peer_program"), "mpf-dac");
  EXPECT_EQ(ofClient.at("server"), "dac");
  EXPECT_EQ(ofClient.at("location"), 2);
  EXPECT_EQ(ofClient.at("client_state"), "open");
  EXPECT_EQ(ofClient.at("server_state"), "refused");
  EXPECT_EQ(ofClient.at("requests"), (json{{"sent", 10}, {"taken", 8}, {"waiting", 2}}));
  EXPECT_EQ(ofClient.at("replies"), (json{{"sent", 6}, {"taken", 5}, {"waiting", 1}}));
  EXPECT_EQ(ofClient.at("refused_sends"), 3);
  EXPECT_EQ(ofClient.at("unanswered"), 4);
}

TEST(ReportJson, ALinkWithoutItsPeerHasNoPeer) {
  const SnapshotDelta delta(test::snapshotOf(0, {}), test::snapshotOf(1, {}, {jsonClient()}));

  EXPECT_FALSE(toJson(delta, delta.now().clients.front()).at("links").at(0).contains("peer_pid"));
}

TEST(ReportJson, ABusyServerHasItsRequest) {
  auto busy = test::serverView(5, 5);
  busy.handling = Handling{.type = static_cast<std::uint16_t>(MessageType::char8Array), .cmd = 3};
  busy.progressAtNs = 250'000'000;
  const SnapshotDelta delta(test::snapshotOf(0, {busy}), test::snapshotOf(kHalfASecond, {busy}));

  EXPECT_EQ(toJson(delta, delta.now().servers.front()).at("handling"),
            (json{{"type", "char8Array"}, {"cmd", 3}, {"since_s", 0.25}}));

  const SnapshotDelta idle(test::snapshotOf(0, {}), test::snapshotOf(kHalfASecond, {busy}));
  EXPECT_FALSE(toJson(idle, idle.now().servers.front()).contains("handling"));
}

// A client that waits may itself be unknown: then its pid is 0.
TEST(ReportJson, NamesTheClientsThatWaitForAServer) {
  auto now = test::snapshotOf(1, {}, {jsonClient()});
  now.backplane = "lab";
  now.pendingBinds = {{test::kClient, "later", 3}, {999, "adc", 0}};
  now.problems = {"a reason"};
  const SnapshotDelta delta(test::snapshotOf(0, {}), std::move(now));

  const auto all = toJson(delta);

  EXPECT_EQ(all.at("backplane"), "lab");
  EXPECT_EQ(all.at("waiting"), (json{{{"server", "later"}, {"location", 3}, {"pid", 17}},
                                     {{"server", "adc"}, {"location", 0}, {"pid", 0}}}));
  EXPECT_EQ(all.at("problems"), json{"a reason"});
  EXPECT_EQ(all.at("servers"), json::array());
  EXPECT_EQ(all.at("routers"), json::array());
  EXPECT_EQ(all.at("clients").size(), 1U);
}

TEST(ReportJson, AConnectionHasItsRatesAndItsWindows) {
  RouterLineView line;
  line.row = 3;
  line.role = layout::RouterRole::client;
  line.state = layout::RouterLineState::connected;
  line.address = "10.0.0.7:9900";
  line.peer = "ioc1";
  line.locations = "1, 2";
  RouterView router;
  router.incarnation = 5;
  router.name = "lab1";
  router.owner.pid = 55;
  router.processState = 'S';
  router.lines = {line};
  auto before = test::snapshotOf(0, {});
  before.routers = {router};
  router.lines.front().messagesSent = 10;
  router.lines.front().bytesReceived = 500;
  router.lines.front().sinceNs = -1'000'000'000;
  auto proxy = test::serverView(0, 0);
  proxy.router = 5;
  proxy.routerRow = 3;
  auto now = test::snapshotOf(kHalfASecond, {proxy});
  now.routers = {router};
  const SnapshotDelta delta(std::move(before), std::move(now));

  const auto all = toJson(delta);

  const auto& ofRouter = all.at("routers").at(0);
  EXPECT_EQ(ofRouter.at("name"), "lab1");
  EXPECT_EQ(ofRouter.at("state"), "alive");
  EXPECT_EQ(ofRouter.at("pid"), 55);
  const auto& ofLine = ofRouter.at("lines").at(0);
  EXPECT_EQ(ofLine.at("role"), "client");
  EXPECT_EQ(ofLine.at("state"), "connected");
  EXPECT_EQ(ofLine.at("since_s"), 1.5);
  EXPECT_EQ(ofLine.at("locations"), (json{1, 2}));
  EXPECT_EQ(ofLine.at("sent_per_s"), 20.0);
  EXPECT_EQ(ofLine.at("bytes_received_per_s"), 1000.0);
  EXPECT_EQ(all.at("servers").at(0).at("via"),
            (json{{"peer", "ioc1"}, {"address", "10.0.0.7:9900"}}));
}

}  // namespace
}  // namespace mpf::tools
