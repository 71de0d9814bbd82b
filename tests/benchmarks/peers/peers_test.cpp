// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <gtest/gtest.h>
#include <stdexcept>

#include "benchmarks/peers/peer.h"
#include "benchmarks/stage/stage.h"

namespace mpf::bench {
namespace {

// Makes some round trips, then sends several requests before it receives their replies.
void expectToAnswer(const PeerFamily& family, Mode mode, std::size_t bytes) {
  const std::shared_ptr<Peer> peer =
      family.make({mode, bytes, true, "mpf-bench-test-" + std::to_string(::getpid())});
  const auto cpus = allowedCpus();
  Workload workload;
  workload.stopsByItself = true;
  workload.grace = std::chrono::minutes(10);
  workload.server = [peer](const RunContext& context) { peer->serve(context); };
  workload.requester = [peer](const RunContext& context) {
    peer->connect(context);
    for (int i = 0; i < 3; ++i) peer->roundTrip();
    for (int i = 0; i < 2; ++i) peer->send();
    for (int i = 0; i < 2; ++i) peer->receive();
    context.stop();
    peer->roundTrip();
  };

  const auto outcome = Stage({{cpus.front()}, {cpus.back()}}, {}).run(workload);
  peer->removeTraces();

  EXPECT_EQ(outcome.error, "") << family.name << ", " << toString(mode) << ", " << bytes
                               << " bytes";
}

void expectToAnswer(const PeerFamily& family) {
  if (!family.skipped.empty()) GTEST_SKIP() << family.skipped;
  for (const auto mode : family.modes) {
    for (const std::size_t bytes : {std::size_t{4}, std::size_t{65536}})
      expectToAnswer(family, mode, bytes);
  }
}

TEST(Peers, MpfAnswers) { expectToAnswer(mpfPeer()); }
TEST(Peers, BoostAnswers) { expectToAnswer(boostPeer()); }
TEST(Peers, SocketAnswers) { expectToAnswer(socketPeer()); }
TEST(Peers, ZeromqAnswers) { expectToAnswer(zeromqPeer()); }
TEST(Peers, AeronAnswers) { expectToAnswer(aeronClientPeer()); }
// iceoryx is not tested: it needs a daemon of which a host can have only one, and tests run in
// parallel.

}  // namespace
}  // namespace mpf::bench
