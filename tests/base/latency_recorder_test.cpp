// SPDX-License-Identifier: MIT
#include "base/latency_recorder.h"

#include <gtest/gtest.h>

namespace mpf {
namespace {

TEST(LatencyRecorder, ReturnsZerosWithoutSamples) {
  const LatencyRecorder recorder;

  EXPECT_EQ(recorder.count(), 0u);
  EXPECT_EQ(recorder.percentileNs(50), 0u);
  EXPECT_EQ(recorder.maxNs(), 0u);
  EXPECT_EQ(recorder.meanNs(), 0.0);
}

TEST(LatencyRecorder, IsExactBelow256Nanoseconds) {
  LatencyRecorder recorder;

  for (std::uint64_t ns = 1; ns <= 200; ++ns) recorder.add(ns);

  EXPECT_EQ(recorder.count(), 200u);
  EXPECT_EQ(recorder.percentileNs(50), 100u);
  EXPECT_EQ(recorder.percentileNs(99), 198u);
  EXPECT_EQ(recorder.percentileNs(99.5), 199u);
  EXPECT_EQ(recorder.percentileNs(100), 200u);
  EXPECT_EQ(recorder.meanNs(), 100.5);
}

// One slow message in a thousand is visible in the maximum, and not in p99.9 or below.
TEST(LatencyRecorder, ShowsASingleOutlierOnlyInTheMaximum) {
  LatencyRecorder recorder;

  for (int i = 0; i < 999; ++i) recorder.add(70);
  recorder.add(12'345'678);

  EXPECT_EQ(recorder.percentileNs(50), 70u);
  EXPECT_EQ(recorder.percentileNs(99.9), 70u);
  EXPECT_EQ(recorder.percentileNs(100), 12'345'678u);
  EXPECT_EQ(recorder.maxNs(), 12'345'678u);
}

TEST(LatencyRecorder, HasAnErrorBelowOnePercentForAllDurations) {
  for (std::uint64_t ns = 1; ns < 100'000'000'000; ns = ns * 9 / 8 + 1) {
    LatencyRecorder recorder;
    recorder.add(ns);
    recorder.add(ns * 10);  // so that the maximum does not limit the result

    const auto told = recorder.percentileNs(50);

    EXPECT_GE(told, ns);
    EXPECT_LE(static_cast<double>(told), static_cast<double>(ns) * 1.01);
  }
}

TEST(LatencyRecorder, CountsDurationsBeyondTheLastBucket) {
  LatencyRecorder recorder;

  recorder.add(UINT64_MAX / 2);

  EXPECT_EQ(recorder.maxNs(), UINT64_MAX / 2);
  EXPECT_GT(recorder.percentileNs(50), 1'000'000'000'000u / 2);
}

TEST(LatencyRecorder, AddsADurationSeveralTimes) {
  LatencyRecorder recorder;

  recorder.add(10, 3);
  recorder.add(900, 0);

  EXPECT_EQ(recorder.count(), 3u);
  EXPECT_EQ(recorder.meanNs(), 10);
  EXPECT_EQ(recorder.maxNs(), 10u);
}

TEST(LatencyRecorder, AddsAnotherRecorder) {
  LatencyRecorder one;
  LatencyRecorder other;
  one.add(10);
  other.add(30);
  other.add(20);

  one.add(other);

  EXPECT_EQ(one.count(), 3u);
  EXPECT_EQ(one.percentileNs(50), 20u);
  EXPECT_EQ(one.maxNs(), 30u);
}

}  // namespace
}  // namespace mpf
