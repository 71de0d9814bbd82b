// SPDX-License-Identifier: MIT
// Snapshot: the contents of the segments of a backplane at one moment.
#include "tools/report/snapshot.h"

#include <unistd.h>

#include <fstream>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "tests/shm/shm_fixture.h"
#include "tests/tools/report/latencies.h"

namespace mpf::tools {
namespace {

using namespace std::chrono_literals;
using test::latencies;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

// A test that waits for a change fails after so many turns of the client.
constexpr int kMostTurns = 10'000;

class SnapshotTest : public test::ShmTest {
 protected:
  [[nodiscard]] Snapshot take() const { return Snapshot::take(name()); }
};

// Clients of one process.
class Clients {
 public:
  explicit Clients(const Backplane& backplane) : dispatcher_(backplane) {}
  MessageClient& bind(const std::string& server, std::int32_t location = 0) {
    clients_.push_back(std::make_unique<MessageClient>(dispatcher_, [](const Message&) {}));
    clients_.back()->bind(server, location);
    return *clients_.back();
  }
  MessageClient& connect(MessageServer& server) {
    auto& client = bind(server.getName(), server.location());
    while (!client.isConnected()) {
      server.handleOne();
      runOnce();
    }
    return client;
  }
  void runOnce() { dispatcher_.runOnce(Deadline::after(100us)); }

 private:
  Dispatcher dispatcher_;
  std::vector<std::unique_ptr<MessageClient>> clients_;
};

TEST_F(SnapshotTest, RefusesAnInvalidBackplaneName) {
  EXPECT_THAT(test::whatOf<std::invalid_argument>([] { static_cast<void>(Snapshot::take("a.b")); }),
              testing::HasSubstr("\"a.b\""));
}

TEST_F(SnapshotTest, HasTheIdentityOfAServer) {
  const MessageServer server(
      backplane_, "dac",
      {.location = 3, .queueSize = 17, .maxMessageBytes = 12345, .waitMode = WaitMode::block});

  const auto snapshot = take();

  ASSERT_THAT(snapshot.servers, SizeIs(1));
  const auto& seen = snapshot.servers.front();
  EXPECT_TRUE(seen.isServer);
  EXPECT_EQ(seen.name, "dac");
  EXPECT_EQ(seen.location, 3);
  EXPECT_EQ(seen.pid, ::getpid());
  EXPECT_THAT(seen.program, testing::StartsWith("tools_unit_test"));
  EXPECT_EQ(seen.queueSize, 17U);
  EXPECT_EQ(seen.maxMessageBytes, 12345U);
  EXPECT_EQ(seen.waitMode, static_cast<std::uint32_t>(WaitMode::block));
  EXPECT_EQ(seen.life, Life::alive);
  EXPECT_GE(seen.ageNs, 0);
  EXPECT_EQ(seen.received, 0U);
  EXPECT_THAT(seen.links, IsEmpty());
  EXPECT_THAT(snapshot.problems, IsEmpty());
}

TEST_F(SnapshotTest, AddsALinkToBothOfItsWindows) {
  MessageServer server(backplane_, "dac", {.location = 0, .queueSize = 17});
  server.on<Int32>([](Int32&) {});
  Clients clients(backplane_);
  auto& client = clients.connect(server);
  for (int i = 0; i < 5; ++i) ASSERT_EQ(client.send(Int32Message()), SendResult::sent);
  while (!server.handleOne()) continue;
  while (!server.handleOne()) continue;

  const auto snapshot = take();

  ASSERT_THAT(snapshot.servers, SizeIs(1));
  ASSERT_THAT(snapshot.servers.front().links, SizeIs(1));
  ASSERT_THAT(snapshot.clients, SizeIs(1));
  ASSERT_THAT(snapshot.clients.front().links, SizeIs(1));
  const auto& link = snapshot.clients.front().links.front();
  EXPECT_EQ(link.incarnation, snapshot.servers.front().links.front().incarnation);
  EXPECT_TRUE(link.isOpen());
  EXPECT_EQ(link.server, "dac");
  EXPECT_EQ(link.queueSize, 17U);
  EXPECT_EQ(link.requests.sent, 5U);
  EXPECT_EQ(link.requests.taken, 2U);
  EXPECT_EQ(link.requests.waiting(), 3U);
  EXPECT_EQ(link.replies.sent, 2U);
  EXPECT_EQ(link.replies.waiting(), 2U);
  EXPECT_EQ(link.unanswered, 5U);
  EXPECT_GT(link.bytes, 4096U);
  EXPECT_EQ(snapshot.servers.front().received, 2U);
  EXPECT_EQ(snapshot.servers.front().sent, 2U);
}

TEST_F(SnapshotTest, CountsTheRepliesOfAllThreads) {
  MessageServer server(backplane_, "dac");
  server.on<Int32>([&](Int32Message&& request) {
    std::jthread([&] { EXPECT_EQ(server.reply(std::move(request)), ReplyResult::sent); }).join();
  });
  Clients clients(backplane_);
  ASSERT_EQ(clients.connect(server).send(Int32Message()), SendResult::sent);
  while (!server.handleOne()) continue;

  EXPECT_EQ(take().servers.front().sent, 1U);
}

// A cancelled request has had its fate, although the server still has to reply to it.
TEST_F(SnapshotTest, CountsTheRequestsWithoutAReplyOrAFate) {
  MessageServer server(backplane_, "dac");
  server.on<Int32>([](Int32&) {});
  Clients clients(backplane_);
  auto& client = clients.connect(server);
  std::uint32_t cancelled = 0;
  ASSERT_EQ(client.send(Int32Message(), Deadline::never(), &cancelled), SendResult::sent);
  for (int i = 0; i < 3; ++i) ASSERT_EQ(client.send(Int32Message()), SendResult::sent);
  const auto unanswered = [this] { return take().clients.front().links.front().unanswered; };
  EXPECT_EQ(unanswered(), 4U);

  client.cancel(cancelled);
  for (int i = 0; i < kMostTurns && unanswered() == 4U; ++i) clients.runOnce();
  EXPECT_EQ(unanswered(), 3U);

  for (int i = 0; i < 2; ++i) {  // replies to the cancelled one and to another one
    while (!server.handleOne()) continue;
  }
  for (int i = 0; i < kMostTurns && unanswered() == 3U; ++i) clients.runOnce();
  EXPECT_EQ(unanswered(), 2U);
}

TEST_F(SnapshotTest, CountsThePoolsInTheMemoryOfALink) {
  MessageServer server(backplane_, "dac");
  Clients clients(backplane_);
  auto& client = clients.connect(server);
  const auto before = take().servers.front().links.front().bytes;

  ASSERT_EQ(client.send(client.alloc<Float64Array>(100'000)), SendResult::sent);

  EXPECT_GE(take().servers.front().links.front().bytes, before + 800'000);
}

TEST_F(SnapshotTest, CountsTheFanOutPoolInTheMemoryOfItsServer) {
  MessageServer server(backplane_, "dac");
  const auto before = take();
  EXPECT_EQ(before.servers.front().fanOutBytes, 0U);

  const auto message = server.allocShared<Float64Array>(100'000);

  const auto after = take();
  EXPECT_GE(after.servers.front().fanOutBytes, 800'000U);
  EXPECT_GE(after.bytes, before.bytes + 800'000U);
  EXPECT_THAT(after.problems, IsEmpty());
}

TEST_F(SnapshotTest, SeveralClientsOfAProcessAreLinksOfOneWindow) {
  MessageServer dac(backplane_, "dac");
  MessageServer adc(backplane_, "adc");
  Clients clients(backplane_);
  clients.connect(dac);
  clients.connect(dac);
  clients.connect(adc);

  const auto snapshot = take();

  std::vector<std::string> servers;
  ASSERT_THAT(snapshot.clients, SizeIs(1));
  for (const auto& link : snapshot.clients.front().links) servers.push_back(link.server);
  EXPECT_THAT(servers, ElementsAre("adc", "dac", "dac"));
  ASSERT_THAT(snapshot.servers, SizeIs(2));
  EXPECT_EQ(snapshot.servers[0].name, "adc");
  EXPECT_THAT(snapshot.servers[0].links, SizeIs(1));
  EXPECT_THAT(snapshot.servers[1].links, SizeIs(2));
}

TEST_F(SnapshotTest, HasThePendingBindOfAClient) {
  Clients clients(backplane_);
  clients.bind("later", 5);
  while (take().pendingBinds.empty()) clients.runOnce();

  const auto snapshot = take();

  ASSERT_THAT(snapshot.pendingBinds, SizeIs(1));
  EXPECT_EQ(snapshot.pendingBinds.front().server, "later");
  EXPECT_EQ(snapshot.pendingBinds.front().location, 5);
  ASSERT_THAT(snapshot.clients, SizeIs(1));
  EXPECT_EQ(snapshot.clients.front().incarnation, snapshot.pendingBinds.front().clientWindow);
  ASSERT_THAT(snapshot.clients.front().pendingBinds, SizeIs(1));
  EXPECT_EQ(snapshot.clients.front().pendingBinds.front().server, "later");
}

TEST_F(SnapshotTest, IgnoresOtherBackplanes) {
  const auto other = Backplane::named(name() + "x");
  const MessageServer server(other, "dac");

  const auto snapshot = take();

  EXPECT_THAT(snapshot.servers, IsEmpty());
  EXPECT_THAT(snapshot.problems, IsEmpty());
}

// The names in headers are untrusted.
TEST_F(SnapshotTest, EscapesControlCharactersInNames) {
  auto window =
      Segment::create(layout::kWindowBytes, layout::SegmentKind::serverWindow, name(), {});
  const std::string evil = "a\x1b[2Jb\n\x7f";
  evil.copy(window.sharedHeader().name.data(), evil.size());
  window.sharedHeader().program = {'\t', 'H', '\r'};
  ASSERT_TRUE(window.tryPublish(serverName()));

  const auto snapshot = take();

  ASSERT_THAT(snapshot.servers, SizeIs(1));
  EXPECT_EQ(snapshot.servers.front().name, R"(a\x1b[2Jb\n\x7f)");
  EXPECT_EQ(snapshot.servers.front().program, R"(\tH\r)");
  segments::remove(serverName());
}

TEST_F(SnapshotTest, ReportsAProblemBesideAllOthers) {
  const MessageServer server(backplane_, "dac");
  const auto junk = segments::path(serverName("junk"));
  std::ofstream(junk) << "junk";

  const auto snapshot = take();

  EXPECT_THAT(snapshot.servers, SizeIs(1));
  EXPECT_THAT(snapshot.problems,
              ElementsAre(junk + ": truncated, 4 bytes are too few for a header"));
  segments::remove(serverName("junk"));
}

TEST_F(SnapshotTest, AForeignFileUnderAnyNameIsAProblem) {
  std::vector<std::string> junk{serverName()};
  for (const char* rest :
       {"c.1", "h.1", "l.1.2", "b.1.0.0", "w.1", "f.1", "x.1", "s.0", "nothing"}) {
    junk.push_back(SegmentName::prefix(name()) + rest);
  }
  for (const auto& each : junk) std::ofstream(segments::path(each)) << "junk";

  const auto problems = take().problems;

  for (const auto& each : junk) {
    EXPECT_THAT(problems, testing::Contains(testing::StartsWith(segments::path(each) + ": ")));
    segments::remove(each);
  }
  EXPECT_THAT(problems, SizeIs(junk.size()));
}

TEST(Latencies, AreZeroWithoutSamples) { EXPECT_EQ(Latencies().percentileNs(50), 0U); }

TEST(Latencies, OneSampleIsEveryPercentile) {
  const auto one = latencies({{1000, 1}});

  for (const double percent : {0.0, 50.0, 99.9, 100.0})
    EXPECT_EQ(one.percentileNs(percent), 1000U) << percent;
}

TEST(Latencies, APercentileIsTheEndOfItsBucket) {
  const auto some = latencies({{1024, 50}, {5000, 49}, {100'000, 1}});

  EXPECT_EQ(some.percentileNs(50), 1280U);
  EXPECT_EQ(some.percentileNs(51), 5120U);
  EXPECT_EQ(some.percentileNs(99), 5120U);
  EXPECT_EQ(some.percentileNs(99.9), 100'000U);
}

// One sample in a thousand is not within the lower 99.9 %, in spite of rounding errors of 99.9.
TEST(Latencies, AnOutlierDoesNotChangeLowerPercentiles) {
  const auto some = latencies({{1024, 999}, {1'000'000, 1}});

  EXPECT_EQ(some.percentileNs(99.9), 1280U);
  EXPECT_EQ(some.percentileNs(100), 1'000'000U);
}

TEST(Latencies, SamplesBeyondTheLastBucketAreTheMaximum) {
  const auto some = latencies({{std::uint64_t{1} << 45, 1}});

  EXPECT_EQ(some.percentileNs(50), std::uint64_t{1} << 45);
}

}  // namespace
}  // namespace mpf::tools
