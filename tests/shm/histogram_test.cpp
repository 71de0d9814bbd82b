// SPDX-License-Identifier: MIT
// Histograms: the bucket of a duration, and the ends of the buckets.
#include "shm/histogram.h"

#include <gtest/gtest.h>
#include <memory>

#include "tests/support/random.h"

namespace mpf::test {
namespace {

constexpr auto kLast = layout::kHistogramBuckets - 1;

TEST(Histogram, EachBucketCoversTheDurationsUpToItsEnd) {
  for (std::uint32_t index = 0; index < kLast; ++index) {
    const auto end = HistogramBuckets::endNs(index);

    EXPECT_EQ(HistogramBuckets::indexOf(end - 1), index);
    EXPECT_EQ(HistogramBuckets::indexOf(end), index + 1);
    EXPECT_LT(end, HistogramBuckets::endNs(index + 1));
  }
}

TEST(Histogram, ADurationIsAtMostAQuarterBelowTheEndOfItsBucket) {
  Random random;

  for (int i = 0; i < 100'000; ++i) {
    const auto ns = random.nasty() >> 23;
    const auto end = HistogramBuckets::endNs(HistogramBuckets::indexOf(ns));
    ASSERT_LT(ns, end);
    ASSERT_LE(end - ns, std::max<std::uint64_t>(ns / 4, 20)) << ns;
  }
}

TEST(Histogram, ExtremeDurationsHaveABucket) {
  EXPECT_EQ(HistogramBuckets::indexOf(0), 0u);
  EXPECT_EQ(HistogramBuckets::indexOf(15), 0u);
  EXPECT_EQ(HistogramBuckets::indexOf(16), 0u);
  EXPECT_EQ(HistogramBuckets::endNs(0), 20u);
  EXPECT_EQ(HistogramBuckets::endNs(kLast), std::uint64_t{1} << 41);
  EXPECT_EQ(HistogramBuckets::indexOf((std::uint64_t{1} << 41) - 1), kLast);
  EXPECT_EQ(HistogramBuckets::indexOf(std::uint64_t{1} << 41), kLast) << "the last one has no end";
  EXPECT_EQ(HistogramBuckets::indexOf(UINT64_MAX), kLast);
}

TEST(Histogram, CountsEachDurationOnceAndKeepsTheLongest) {
  const auto histogram = std::make_unique<layout::Histogram>();

  record(*histogram, 100);
  record(*histogram, 5'000'000);
  record(*histogram, 100);
  record(*histogram, -1);
  record(*histogram, INT64_MAX);

  const auto at = [&](std::uint64_t ns) {
    return histogram->buckets[HistogramBuckets::indexOf(ns)].load(std::memory_order_relaxed);
  };
  EXPECT_EQ(at(100), 2u);
  EXPECT_EQ(at(5'000'000), 1u);
  EXPECT_EQ(at(0), 1u) << "a negative duration counts as 0";
  EXPECT_EQ(at(UINT64_MAX), 1u);
  EXPECT_EQ(histogram->maxNs.load(std::memory_order_relaxed),
            static_cast<std::uint64_t>(INT64_MAX));
}

}  // namespace
}  // namespace mpf::test
