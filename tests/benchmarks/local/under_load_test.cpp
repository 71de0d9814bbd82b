// SPDX-License-Identifier: MIT
// Rows whose CPUs have other work.
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/measurement.h"

namespace mpf::bench {
namespace {

std::vector<Measurement> rowsOfThisProcess() {
  return underLoadMeasurements(kRunPrefix + std::to_string(::getpid()));
}

TEST(UnderLoad, HasMpfInEachModeBesideFutexAndSocket) {
  std::vector<std::string> names;
  for (const auto& row : rowsOfThisProcess()) {
    names.push_back(row.name + ", " + toString(row.mode));
    EXPECT_EQ(row.floorName, row.name == kLoadedFutexBounce ? "" : kLoadedFutexBounce);
  }

  EXPECT_THAT(names,
              testing::ElementsAre("futex bounce, busy CPUs, block", "MPF, spin", "MPF, adaptive",
                                   "MPF, block", "Unix socket, spin", "Unix socket, block"));
}

TEST(UnderLoad, EndsTheLoadWithTheRow) {
  const auto cpu = allowedCpus().front();
  const Stage stage({{cpu}, {cpu}}, {std::chrono::milliseconds(1), std::chrono::milliseconds(4)});

  const auto outcome = rowsOfThisProcess().front().run(stage);

  EXPECT_EQ(outcome.error, "");
  EXPECT_GT(outcome.figures.latency.count(), 0u);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child process remains";
}

}  // namespace
}  // namespace mpf::bench
