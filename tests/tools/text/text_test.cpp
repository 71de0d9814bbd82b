// SPDX-License-Identifier: MIT
// Tables and sparklines.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/histogram.h"
#include "tools/report/sparkline.h"
#include "tools/text/table.h"

namespace mpf::tools {
namespace {

TEST(Table, ColumnsAreAsWideAsTheirWidestCell) {
  Table table({"NAME", ">COUNT", "WORD"});
  table.add({"a", "1", "x"});
  table.add({"longer", "12345678", "y"});

  EXPECT_EQ(table.text(),
            "NAME       COUNT  WORD\n"
            "a              1  x\n"
            "longer  12345678  y\n");
}

TEST(Table, IndentsRowsAndHasNoTrailingBlanks) {
  Table table({"A", "B"});
  table.add({"1", ""});

  EXPECT_EQ(table.text("  "), "  A  B\n  1\n");
}

TEST(Table, IsEmptyUntilSomethingIsAdded) {
  Table table({"A"});
  EXPECT_TRUE(table.isEmpty());

  table.add({""});

  EXPECT_FALSE(table.isEmpty());
}

// Columns are aligned by the visible width of a name, not by its number of bytes.
TEST(Table, AlignsNamesByColumnsNotBytes) {
  Table table({"NAME", ">UNIT", "WORD"});
  table.add({"Ofen-Süd", "°C", "x"});
  table.add({"電圧", "V", "y"});

  EXPECT_EQ(table.text(),
            "NAME      UNIT  WORD\n"
            "Ofen-Süd    °C  x\n"
            "電圧         V  y\n");
}

TEST(Table, CountsInvalidUtf8AsOneColumnForEachByte) {
  Table table({"A", "B"});
  table.add({"\xff\xfe", "x"});
  table.add({"123", "y"});

  EXPECT_EQ(table.text(), "A    B\n\xff\xfe   x\n123  y\n");
}

Latencies latencies(std::initializer_list<std::pair<std::uint64_t, std::uint64_t>> samples) {
  Latencies made;
  for (const auto& [ns, count] : samples) {
    made.buckets[HistogramBuckets::indexOf(ns)] += count;
    made.count += count;
    made.maxNs = std::max(made.maxNs, ns);
  }
  return made;
}

TEST(Sparkline, IsEmptyWithoutSamples) { EXPECT_EQ(sparkline({}, 80), ""); }

TEST(Sparkline, ShowsTheBucketsFromTheFirstSampleToTheLast) {
  EXPECT_EQ(sparkline(latencies({{512, 1}, {1000, 8}}), 80), "512 ns ▁  █ 1024 ns");
}

TEST(Sparkline, BlocksAreAsHighAsTheirShareOfTheFullestBucket) {
  EXPECT_EQ(sparkline(latencies({{1024, 800}, {1280, 400}, {1536, 100}, {1792, 1}}), 80),
            "1024 ns █▄▁▁ 2048 ns");
}

// A count of 2^64 - 1 in a hostile segment causes no overflow.
TEST(Sparkline, TheLargestCountIsTheHighestBlock) {
  Latencies all;
  all.count = 2;
  all.buckets[0] = ~std::uint64_t{0};
  all.buckets[1] = 1;

  EXPECT_EQ(sparkline(all, 80), "0.0 ns █▁ 24.0 ns");
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
