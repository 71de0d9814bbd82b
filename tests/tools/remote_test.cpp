// SPDX-License-Identifier: MIT
// Two real routers on two backplanes: every tool works with servers on the other side.
#include "tests/support/router_pair.h"
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::IsEmpty;

class RemoteTest : public testing::Test {
 protected:
  void TearDown() override { routers_.expectGoodEnd(); }
  [[nodiscard]] Ended near(std::vector<std::string> arguments) const {
    return runTool(std::move(arguments), routers_.near().name());
  }
  [[nodiscard]] Ended far(std::vector<std::string> arguments) const {
    return runTool(std::move(arguments), routers_.far().name());
  }
  [[nodiscard]] nlohmann::json ls(const Backplane& backplane) const {
    const auto ended = runTool({"ls", "--json", "--interval", "1ms"}, backplane.name());
    EXPECT_EQ(ended.status, 0) << ended.err;
    return nlohmann::json::parse(ended.out).at(0);
  }
  [[nodiscard]] nlohmann::json line(const Backplane& backplane) const {
    return ls(backplane).at("routers").at(0).at("lines").at(0);
  }
  void awaitState(const std::string& state) const {
    while (line(routers_.near()).at("state") != state) continue;
  }
  void awaitRoundTrip() const {
    while (line(routers_.near()).at("round_trip_ns") == 0) continue;
  }

  Watchdog watchdog_{testing::UnitTest::GetInstance()->current_test_info()->name()};
  RouterPair routers_;
};

TEST_F(RemoteTest, CallReachesAServerOnAnotherHost) {
  routers_.start();
  const EchoThread echo(routers_.far(), "echo", {.location = RouterPair::kLocation});

  const auto ended =
      near({"call", "echo", "int32", "value=7", "--location", "1", "--timeout", "100"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  EXPECT_THAT(ended.out, HasSubstr(" value=7\n"));
  EXPECT_EQ(near({"call", "echo", "int32", "--location", "1", "--timeout", "100", "--count", "300"})
                .status,
            0);
}

// The limit of either router or of the server applies.
TEST_F(RemoteTest, ATooLargeMessageIsRefusedWithTheLimit) {
  const RouterPair::Options small{"--max-message-size", "1000"};
  struct Limited {
    RouterPair::Options near, far;
    std::uint64_t maxMessageBytes;
  };
  for (const auto& [nearOptions, farOptions, maxMessageBytes] :
       {Limited{small, {}, 5000}, {{}, small, 5000}, {{}, {}, 1000}}) {
    routers_.startFar(farOptions);
    routers_.startNear(nearOptions);
    const EchoThread echo(routers_.far(), "echo",
                          {.location = RouterPair::kLocation, .maxMessageBytes = maxMessageBytes});
    const std::string most(1000 - sizeof(Char8Array), 'x');

    const auto tooLarge = near({"call", "echo", "char8Array", "value=" + most + "x", "--location",
                                "1", "--timeout", "100"});

    EXPECT_EQ(tooLarge.status, 1);
    EXPECT_EQ(tooLarge.err,
              "mpf call: not sent: larger than the server allows: 1001 bytes, the limit is 1000\n");
    EXPECT_EQ(
        near({"call", "echo", "char8Array", "value=" + most, "--location", "1", "--timeout", "100"})
            .status,
        0);
  }
}

TEST_F(RemoteTest, ReportsShowServersOnOtherHosts) {
  routers_.start();
  const EchoThread echo(routers_.far(), "echo", {.location = RouterPair::kLocation});
  SyncClient client(routers_.near(), "echo", RouterPair::kLocation);
  ASSERT_TRUE(client.call(Int32Message(), 60s));
  awaitRoundTrip();

  const auto list = near({"ls"}).out;
  const auto routers = near({"mrr", "--interval", "1ms"}).out;
  const auto server = near({"msr", "echo", "--location", "1"}).out;
  const auto there = far({"mrr", "--interval", "1ms"}).out;

  EXPECT_THAT(list, AllOf(ContainsRegex("  echo@1 +alive +[0-9]+ +→ "),
                          ContainsRegex("  → " + routers_.address() + " +connected +1 ")));
  EXPECT_THAT(
      routers,
      AllOf(ContainsRegex("RMRClient stateConnected queueSize 256 inQueue 0 sendQueueFull 0\n"
                          "   Server echo@1 has 1 client. bindState connected\n"
                          "   sendPerSec [0-9]+ receivePerSec [0-9]+  tcpSendPerSec [0-9]+ "
                          "tcpReceivePerSec [0-9]+\n"),
            HasSubstr(" address " + routers_.address() + " plain locations 1\n")));
  EXPECT_THAT(server, AllOf(HasSubstr("queueRequests 1\n"),
                            HasSubstr(routers_.address() + ", connected, round trip ")));
  EXPECT_THAT(there,
              ContainsRegex("RMRServer stateConnected queueSize 256 inQueue 0 replyQueueFull 0\n"
                            "   Server echo@1 has 1 client. bindState connected\n"));
  const auto seen = line(routers_.near());
  EXPECT_GE(seen.at("messages_sent"), 1);
  EXPECT_GE(seen.at("messages_received"), 1);
  EXPECT_GT(seen.at("bytes_sent"), 0);
  EXPECT_EQ(seen.at("connects"), 1);
  EXPECT_EQ(seen.at("clients"), 1);
  EXPECT_EQ(line(routers_.far()).at("role"), "server");
}

TEST_F(RemoteTest, ReportsShowALostConnectionAndItsReturn) {
  routers_.start();
  awaitState("connected");

  routers_.farRouter().end(SIGKILL);
  awaitState("waiting");

  const auto gone = line(routers_.near());
  EXPECT_THAT(gone.at("problem").get<std::string>(), testing::Not(IsEmpty()));
  EXPECT_EQ(gone.at("round_trip_ns"), 0) << "the connection has ended";
  EXPECT_EQ(gone.at("in_queue"), 0);
  EXPECT_EQ(gone.at("queue_size"), 256);
  EXPECT_THAT(near({"mrr", "--interval", "1ms"}).out, HasSubstr("   problem "));
  EXPECT_EQ(ls(routers_.far()).at("routers").at(0).at("state"), "dead");
  EXPECT_THAT(far({"clean"}).out, HasSubstr(".r."));
  EXPECT_THAT(ls(routers_.far()).at("routers"), IsEmpty());

  routers_.startFar();
  awaitState("connected");
  EXPECT_EQ(line(routers_.near()).at("connects"), 2);
  EXPECT_EQ(line(routers_.near()).at("problem"), "");
}

TEST_F(RemoteTest, AClientOfAnAbsentServerWaitsAtTheRouter) {
  routers_.start();
  awaitState("connected");
  Tool call({"call", "later", "int32", "value=3", "--location", "1", "--timeout", "1000"},
            routers_.near().name());
  while (ls(routers_.near()).at("waiting").empty()) continue;

  EXPECT_THAT(near({"mrr", "--interval", "1ms"}).out,
              HasSubstr("   Server later@1 has 1 client. bindState waiting for the server\n"));

  const EchoThread echo(routers_.far(), "later", {.location = RouterPair::kLocation});
  EXPECT_EQ(call.end().status, 0);
}

TEST_F(RemoteTest, TopShowsTheConnection) {
  routers_.start();
  awaitState("connected");

  EXPECT_THAT(near({"top", "--batch", "1", "--interval", "0.01", "--routers"}).out,
              ContainsRegex("\n→ .* connected "));
}

}  // namespace
}  // namespace mpf::test
