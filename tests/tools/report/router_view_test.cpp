// SPDX-License-Identifier: MIT
// The connections of a router in a snapshot.
#include "tools/report/router_view.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <mpf/clock.h>
#include <mpf/message_server.h>

#include "tests/shm/shm_fixture.h"
#include "tests/tools/report/router_rows.h"
#include "tools/report/snapshot.h"

namespace mpf::tools {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

class RouterViewTest : public test::ShmTest {
 protected:
  [[nodiscard]] Snapshot take() const { return Snapshot::take(name()); }
  // The rows of the only router.
  [[nodiscard]] RouterView router() const {
    const auto snapshot = take();
    EXPECT_THAT(snapshot.routers, SizeIs(1));
    return snapshot.routers.empty() ? RouterView() : snapshot.routers.front();
  }
};

TEST_F(RouterViewTest, HasNamePidAndProgramOfTheRouter) {
  const router::Statistics statistics(backplane_, "lab1");

  const auto seen = router();

  EXPECT_EQ(seen.name, "lab1");
  EXPECT_EQ(seen.owner.pid, ::getpid());
  EXPECT_THAT(seen.program, testing::StartsWith("tools_unit_test"));
  EXPECT_EQ(seen.life, Life::alive);
  EXPECT_GE(seen.ageNs, 0);
  EXPECT_EQ(seen.bytes, layout::kRouterBytes);
  EXPECT_THAT(seen.lines, IsEmpty());
  EXPECT_THAT(take().problems, IsEmpty());
}

TEST_F(RouterViewTest, HasARowForEachConnection) {
  router::Statistics statistics(backplane_, "lab1");
  const auto caller = test::connectedCaller(statistics);
  const auto remote = test::connectedRemote(statistics, {1, 2});
  test::set((*remote)->messagesSent, 11);
  test::set((*remote)->messagesReceived, 12);
  test::set((*remote)->framesSent, 13);
  test::set((*remote)->framesReceived, 14);
  test::set((*remote)->bytesSent, 15);
  test::set((*remote)->bytesReceived, 16);

  const auto lines = router().lines;

  ASSERT_THAT(lines, SizeIs(2));
  const auto& seen = lines.front();  // remotes first
  EXPECT_TRUE(seen.isClient());
  EXPECT_TRUE(seen.isConnected());
  EXPECT_FALSE(seen.isTls);
  EXPECT_EQ(seen.address, "10.0.0.7:9900");
  EXPECT_EQ(seen.peer, "ioc1");
  EXPECT_EQ(seen.program, "mpf-router 0.1.0");
  EXPECT_THAT(seen.locationList(), ElementsAre(1, 2));
  EXPECT_EQ(seen.problem, "");
  EXPECT_EQ(seen.reconnects(), 2U);
  EXPECT_EQ(seen.queueSize, 100U);
  EXPECT_EQ(seen.inQueue, 7U);
  EXPECT_EQ(seen.queueFull, 2U);
  EXPECT_EQ(seen.messagesSent, 11U);
  EXPECT_EQ(seen.messagesReceived, 12U);
  EXPECT_EQ(seen.framesSent, 13U);
  EXPECT_EQ(seen.framesReceived, 14U);
  EXPECT_EQ(seen.bytesSent, 15U);
  EXPECT_EQ(seen.bytesReceived, 16U);
  EXPECT_EQ(seen.roundTripNs, 81'200U);
  EXPECT_EQ(seen.clients, 4U);
  EXPECT_EQ(seen.bindings, 1U);
  EXPECT_LE(seen.sinceNs, Clock::nowNs());
  EXPECT_FALSE(lines.back().isClient());
  EXPECT_TRUE(lines.back().isTls);
  EXPECT_EQ(lines.back().peer, "ioc2");
}

TEST_F(RouterViewTest, DropsTheRowOfAnEndedConnection) {
  router::Statistics statistics(backplane_, "lab1");
  auto caller = test::connectedCaller(statistics);
  EXPECT_THAT(router().lines, SizeIs(1));

  caller.reset();

  EXPECT_THAT(router().lines, IsEmpty());
}

// The time shown is that since the connection was lost, not since the last attempt.
TEST_F(RouterViewTest, AnotherAttemptDoesNotResetTheTimeWithoutConnection) {
  router::Statistics statistics(backplane_, "lab1");
  const auto remote = test::lostRemote(statistics);
  const auto since = router().lines.front().sinceNs;

  remote->setState(layout::RouterLineState::connecting);
  EXPECT_EQ(router().lines.front().sinceNs, since);
  remote->setState(layout::RouterLineState::connected);
  const auto connectedSince = router().lines.front().sinceNs;
  EXPECT_GT(connectedSince, since);
  remote->setState(layout::RouterLineState::waiting);

  EXPECT_GT(router().lines.front().sinceNs, connectedSince);
}

// The name of a peer is sent by another host and untrusted.
TEST_F(RouterViewTest, RemovesControlCharactersFromTexts) {
  router::Statistics statistics(backplane_, "l\x1b[2Jab");
  const auto remote = test::lostRemote(statistics,
                                       "a\nb\x7f\xc2\x9b"
                                       "2Jc\xc2\xb0");
  remote->setPeer("\x1b]0;x\a", "\tp");
  remote->setAddress("\r");

  const auto seen = router();

  EXPECT_EQ(seen.name, R"(l\x1b[2Jab)");
  EXPECT_EQ(seen.lines.front().problem, "a\\nb\\x7f\\u009b2Jc\xc2\xb0");
  EXPECT_EQ(seen.lines.front().peer, R"(\x1b]0;x\x07)");
  EXPECT_EQ(seen.lines.front().program, R"(\tp)");
  EXPECT_EQ(seen.lines.front().address, R"(\r)");
}

// The text is half written half of the time, for 20 us each: much less than the reader waits.
TEST_F(RouterViewTest, WaitsForTheEndOfAHalfWrittenText) {
  router::Statistics statistics(backplane_, "lab1");
  const auto remote = test::lostRemote(statistics, "whole");
  const auto write = [&](const std::string& text) {
    std::ranges::copy(text + '\0', (*remote)->problem.begin());
  };
  const auto wait = [] {
    const auto begin = Clock::nowNs();
    while (Clock::nowNs() - begin < Nanoseconds(20us).count()) continue;
  };
  std::atomic<bool> done{false};
  std::size_t standstills = 0;  // number of times that the text stayed half written for longer
  std::thread writer([&] {
    for (int i = 0; !done; ++i) {
      const auto begin = Clock::nowNs();
      (*remote)->texts.fetch_add(1);
      write("half " + std::to_string(i));
      wait();
      write("whole");
      (*remote)->texts.fetch_add(1);
      if (Clock::nowNs() - begin > Nanoseconds(100us).count()) ++standstills;
      wait();
    }
  });

  std::set<std::string> halves;
  for (int i = 0; i < 500; ++i) {
    const auto problem = router().lines.front().problem;
    if (problem != "whole") halves.insert(problem);
  }

  done = true;
  writer.join();
  EXPECT_LE(halves.size(), standstills) << testing::PrintToString(halves);
}

// The router was stopped or killed while it wrote the text.
TEST_F(RouterViewTest, ReturnsATextThatIsNeverCompleted) {
  router::Statistics statistics(backplane_, "lab1");
  const auto remote = test::lostRemote(statistics, "half");
  test::set((*remote)->texts, 7);

  EXPECT_EQ(router().lines.front().problem, "half");
}

TEST_F(RouterViewTest, ARouterWithoutItsLockIsDead) {
  auto segment = Segment::create(layout::kRouterBytes, layout::SegmentKind::router, name(), {});
  ASSERT_TRUE(segment.tryPublish(
      SegmentName::keyed(name(), NameKind::router, segment.sharedHeader().incarnation)));

  EXPECT_EQ(router().life, Life::dead);
  EXPECT_THAT(backplane_.removeDead(), SizeIs(1));
}

// A file that is too short for all rows has only those that fit.
TEST_F(RouterViewTest, AShortFileHasFewerRows) {
  auto segment =
      Segment::create(layout::kRouterLinesOffset + 100, layout::SegmentKind::router, name(), {});
  ASSERT_TRUE(segment.tryPublish(
      SegmentName::keyed(name(), NameKind::router, segment.sharedHeader().incarnation)));

  EXPECT_THAT(router().lines, IsEmpty());
  EXPECT_THAT(backplane_.removeDead(), SizeIs(1));
}

TEST_F(RouterViewTest, ReadsManyConnections) {
  router::Statistics statistics(backplane_, "lab1");
  std::vector<test::Row> rows;
  for (std::uint32_t i = 0; i < layout::kRouterLines + 10; ++i)
    rows.push_back(test::connectedCaller(statistics));

  EXPECT_THAT(router().lines, SizeIs(layout::kRouterLines));
}

TEST(RouterLineView, LocationsAreNumbersBetweenCommas) {
  const auto listOf = [](const std::string& text) {
    RouterLineView line;
    line.locations = text;
    return line.locationList();
  };
  EXPECT_THAT(listOf("1"), ElementsAre(1));
  EXPECT_THAT(listOf("1, -2, 33"), ElementsAre(1, -2, 33));
  EXPECT_THAT(listOf(""), IsEmpty());
  EXPECT_THAT(listOf("x, 2y, 3,, ,"), ElementsAre(3));
}

// A long list is cut at the end of its field, perhaps inside a number.
TEST_F(RouterViewTest, TheOnlyRemoteReachesLocationsThatItsListOmits) {
  router::Statistics statistics(backplane_, "lab1");
  std::vector<std::int32_t> many;
  for (int location = 100; location < 140; ++location) many.push_back(location);
  const auto remote = test::connectedRemote(statistics, many);

  const auto only = router();
  ASSERT_NE(only.lineTo(139), nullptr);
  EXPECT_EQ(only.lineTo(139)->row, only.lines.front().row);

  const auto other = test::lostRemote(statistics);
  const auto two = router();
  EXPECT_EQ(two.lineTo(139), nullptr) << "it may be either";
  ASSERT_NE(two.lineTo(8), nullptr);
  EXPECT_EQ(two.lineTo(8)->address, "10.0.0.8:9900");
}

// A server window of a router belongs to the connection that reaches its location.
TEST_F(RouterViewTest, AssignsServersToTheConnectionOfTheirLocation) {
  router::Statistics statistics(backplane_, "lab1");
  const auto lost = test::lostRemote(statistics);
  const auto remote = test::connectedRemote(statistics, {1, 2});
  const MessageServer proxy(backplane_, "dac", {.location = 2});
  const MessageServer other(backplane_, "dac", {.location = 3});

  const auto snapshot = take();

  ASSERT_THAT(snapshot.servers, SizeIs(2));
  EXPECT_EQ(snapshot.servers.front().router, snapshot.routers.front().incarnation);
  EXPECT_EQ(snapshot.servers.front().routerRow, snapshot.routers.front().lineTo(2)->row);
  EXPECT_EQ(snapshot.servers.back().router, 0U);
}

// The windows of two callers with the same name cannot be assigned.
TEST_F(RouterViewTest, AssignsClientsToTheCallerOfTheirLabel) {
  router::Statistics statistics(backplane_, "lab1");
  const auto caller = test::connectedCaller(statistics);

  const auto one = router();
  ASSERT_NE(one.lineFrom("router ioc2"), nullptr);
  EXPECT_EQ(one.lineFrom("router ioc1"), nullptr);

  const auto again = test::connectedCaller(statistics);
  EXPECT_EQ(router().lineFrom("router ioc2"), nullptr);
}

TEST_F(RouterViewTest, FindsALabelThatWasCut) {
  router::Statistics statistics(backplane_, "lab1");
  const auto caller = test::connectedCaller(statistics);
  caller->setPeer(std::string(63, 'p'), "");

  EXPECT_NE(router().lineFrom("router " + std::string(56, 'p')), nullptr);
}

}  // namespace
}  // namespace mpf::tools
