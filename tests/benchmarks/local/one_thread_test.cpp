// SPDX-License-Identifier: MIT
// The row in which one thread plays both sides.
#include <unistd.h>

#include <gtest/gtest.h>

#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/measurement.h"

namespace mpf::bench {
namespace {

TEST(OneThread, ClientAndServerExchangeMessages) {
  const auto rows = oneThreadMeasurements(kRunPrefix + std::to_string(::getpid()));
  ASSERT_EQ(rows.size(), 1u);

  const Stage stage({}, {std::chrono::milliseconds(1), std::chrono::milliseconds(10)});
  const auto outcome = rows.front().run(stage);

  EXPECT_EQ(outcome.error, "");
  EXPECT_GT(outcome.figures.typicalNs, 0);
  EXPECT_GT(outcome.figures.latency.count(), 0u);
}

}  // namespace
}  // namespace mpf::bench
