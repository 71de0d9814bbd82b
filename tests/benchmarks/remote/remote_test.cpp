// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/system_call.h"
#include "benchmarks/remote/bare_peer.h"
#include "benchmarks/remote/routers.h"
#include "benchmarks/remote/surroundings.h"
#include "benchmarks/remote/tcp_peer.h"
#include "benchmarks/stage/shared_object.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::bench {
namespace {

using testing::HasSubstr;

Stage stageOnTwo() {
  const auto cpus = allowedCpus();
  return Stage({{cpus.front()}, {cpus.back()}}, {});
}

ino_t netOf(const std::string& process) {
  struct stat file{};
  return ::stat(("/proc/" + process + "/ns/net").c_str(), &file) == 0 ? file.st_ino : 0;
}

// Sends requests and receives their replies, `window` of them at a time. Returns what went wrong.
std::string exchange(const std::shared_ptr<Peer>& peer, int window) {
  const SharedObject<std::atomic<bool>> hasServed;
  Workload workload;
  workload.stopsByItself = true;
  workload.stopGrace = workload.grace = std::chrono::minutes(10);
  workload.scratchBytes = kBareScratchBytes;
  workload.server = [&](const RunContext& context) {
    peer->serve(context);
    *hasServed = true;
  };
  workload.requester = [&](const RunContext& context) {
    peer->connect(context);
    for (int round = 0; round < 3; ++round) {
      for (int i = 0; i < window; ++i) peer->send();
      for (int i = 0; i < window; ++i) peer->receive();
    }
    context.stop();
    peer->roundTrip();
    if (::waitpid(-1, nullptr, WNOHANG) != -1) throw std::runtime_error("a process is left");
  };
  const auto error = stageOnTwo().run(workload).error;
  return error.empty() && !*hasServed ? "the server did not end by itself" : error;
}

void expectToEcho(const Surroundings& between, std::size_t unitBytes, int window) {
  EXPECT_EQ(exchange(makeTcpPeer({between, unitBytes, window > 1}), window), "")
      << unitBytes << " bytes, " << window << " at a time";
}

TEST(TcpPeer, EchoesOnLoopback) {
  expectToEcho(Surroundings::loopback(), 4, 1);
  expectToEcho(Surroundings::loopback(), 4000, 1);
}

// More data than the buffers between both sides hold causes no deadlock.
TEST(TcpPeer, EchoesMoreThanTheBuffersHold) {
  expectToEcho(Surroundings::loopback(), 1u << 20, 40);
}

TEST(BarePeer, BringsFramesBack) {
  EXPECT_EQ(exchange(makeBarePeer(Surroundings::loopback(), 128), 1), "");
  EXPECT_EQ(exchange(makeBarePeer(Surroundings::loopback(), 1u << 20), 1), "");
}

// Skipped where this user may not create namespaces.
class NamespacesTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      between_ = Surroundings::namespaces();
    } catch (const std::exception& reason) {
      GTEST_SKIP() << reason.what();
    }
  }
  const ino_t before_ = netOf("self");
  Surroundings between_ = Surroundings::loopback();
};

TEST_F(NamespacesTest, JoinBothSides) {
  expectToEcho(between_, 4, 1);
  expectToEcho(between_, 1u << 20, 4);
  EXPECT_EQ(exchange(makeBarePeer(between_, 128), 1), "");
}

TEST_F(NamespacesTest, LeaveTheCreatingProcessInItsOwn) {
  EXPECT_EQ(netOf("self"), before_);
  EXPECT_NE(between_.serverAddress(), Surroundings::loopback().serverAddress());
}

bool hasProcess(ino_t net) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    if (netOf(entry.path().filename().string()) == net) return true;
  }
  return false;
}

// Only the runner's processes and descriptors keep the namespaces: killing it removes both.
TEST_F(NamespacesTest, ContainNoProcessAfterTheRunnerIsKilled) {
  const test::Watchdog watchdog("namespaces of a killed runner");
  std::array<int, 2> ends{};
  checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
  const FileDescriptor tells(ends[1]);
  const auto tellAndWait = [&] {
    const auto net = netOf("self");
    if (::write(tells.get(), &net, sizeof net) != sizeof net) std::_Exit(1);
    for (;;) ::pause();
  };
  const int runner = forkProcess([&] {
    const auto between = Surroundings::namespaces();
    Workload workload;
    workload.grace = std::chrono::minutes(10);
    workload.server = [&](const RunContext& context) {
      between.enterServer();
      context.ready();
      tellAndWait();
    };
    workload.requester = [&](const RunContext&) {
      between.enterRequester();
      tellAndWait();
    };
    static_cast<void>(stageOnTwo().run(workload));
  });
  const FileDescriptor told(ends[0]);
  std::array<ino_t, 2> nets{};
  for (auto& net : nets)
    ASSERT_EQ(::read(told.get(), &net, sizeof net), static_cast<ssize_t>(sizeof net));
  ASSERT_NE(nets[0], nets[1]);
  for (const auto net : nets) ASSERT_TRUE(net != netOf("self") && hasProcess(net));

  killProcess(runner);

  for (const auto net : nets) {
    while (hasProcess(net)) ::sched_yield();
  }
}

// Uses a shell script in place of mpf-router.
class RouterPairTest : public testing::Test {
 protected:
  std::unique_ptr<RouterPair> routers(const std::string& script) {
    const auto program = folder_.write("router", "#!/bin/bash\n" + script);
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    const auto cpus = allowedCpus();
    return std::make_unique<RouterPair>(program, "mpf-bench-test-" + std::to_string(::getpid()),
                                        Placement{{cpus.front()}, {cpus.back()}},
                                        Surroundings::loopback());
  }
  // As the server's router, prints an address first; then both routers run `rest`.
  static std::string listening(const std::string& rest) {
    return "fd=; while [ $# -gt 0 ]; do [ $1 = --ready-fd ] && fd=$2; shift; done\n"
           "if [ -n \"$fd\" ]; then echo 127.0.0.1:7 >&$fd; exec {fd}>&-; fi\n" +
           rest + "\n";
  }
  static Outcome well() { return {}; }
  test::TemporaryFolder folder_;
};

TEST_F(RouterPairTest, ReportsWhyARouterDidNotStart) {
  const auto pair = routers("echo 'no such place' >&2; exit 1\n");

  try {
    pair->start();
    FAIL() << "start() did not throw";
  } catch (const std::exception& error) {
    EXPECT_STREQ(error.what(), "the server's router did not start: no such place");
  }
}

TEST_F(RouterPairTest, RunsRowsWhileBothRoutersRun) {
  const auto pair = routers(listening("exec sleep 3600"));

  pair->start();

  EXPECT_EQ(pair->run(well).error, "");
  EXPECT_GT(pair->serverPid(), 0);
  EXPECT_NE(pair->serverPid(), pair->clientPid());
}

TEST_F(RouterPairTest, AddsTheOutputOfTheClientsRouterToAnError) {
  const auto pair = routers(
      listening("[ -n \"$fd\" ] && exec sleep 3600; echo 'the line is bad' >&2; exec sleep 3600"));
  pair->start();
  const auto failing = [] {
    Outcome outcome;
    outcome.error = "no end";
    return outcome;
  };
  const test::Watchdog watchdog("a router that prints a line");

  // The script prints the line at an unknown time.
  std::string error;
  while (error.empty() || error == "no end") error = pair->run(failing).error;

  EXPECT_EQ(error, "no end; last output of the client's router: the line is bad");
}

TEST_F(RouterPairTest, EndsBothRoutersAtItsStop) {
  const auto pair = routers(listening("exec sleep 3600"));
  pair->start();
  const int server = pair->serverPid();
  const int client = pair->clientPid();

  pair->stop();

  EXPECT_NE(::kill(server, 0), 0);
  EXPECT_NE(::kill(client, 0), 0);
}

TEST_F(RouterPairTest, ReportsTheLastOutputOfARouterThatHasEnded) {
  const test::Watchdog watchdog("a router that ends");
  const auto pair =
      routers(listening("[ -n \"$fd\" ] && exec sleep 3600; echo 'an accident' >&2; exit 3"));
  pair->start();

  // The script ends at an unknown time.
  std::string error;
  while (error.empty()) error = pair->run(well).error;

  EXPECT_EQ(error, "the client's router has ended: an accident");
}

TEST_F(RouterPairTest, StartsAgainAfterItsStop) {
  const auto pair = routers(listening("exec sleep 3600"));
  pair->start();
  pair->stop();

  pair->start();

  EXPECT_EQ(pair->run(well).error, "");
}

}  // namespace
}  // namespace mpf::bench
