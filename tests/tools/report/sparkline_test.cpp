// SPDX-License-Identifier: MIT
#include "tools/report/sparkline.h"

#include <gtest/gtest.h>

#include "tests/tools/report/latencies.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

using test::latencies;

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

// Two or four buckets share a block when the line would be too long: the times at its ends stay.
TEST(Sparkline, JoinsBucketsUntilTheLineFits) {
  const auto wide = latencies({{512, 1}, {(std::uint64_t{1} << 19) - 1, 1}});  // 40 buckets
  const auto blocksIn = [&](std::size_t columns) {
    const auto line = sparkline(wide, columns);
    EXPECT_TRUE(line.starts_with("512 ns ")) << line;
    EXPECT_TRUE(line.ends_with(" 524.3 us")) << line;
    return columnsOf(line) - std::string_view("512 ns  524.3 us").size();
  };

  EXPECT_EQ(blocksIn(62), 40U);
  EXPECT_EQ(blocksIn(61), 20U);
  EXPECT_EQ(blocksIn(42), 20U);
  EXPECT_EQ(blocksIn(41), 10U);
  EXPECT_EQ(blocksIn(1), 10U) << "a block for each power of two is the least";
}

TEST(Sparkline, ABlockIsTheSumOfItsBuckets) {
  // 1024 and 1280 share a block in the narrow line: their sum is the largest count.
  const auto some = latencies({{1024, 50}, {1280, 50}, {1536, 80}, {1 << 19, 1}});

  EXPECT_TRUE(sparkline(some, 80).starts_with("1024 ns ▅▅█ ")) << sparkline(some, 80);
  EXPECT_TRUE(sparkline(some, 50).starts_with("1024 ns █▆ ")) << sparkline(some, 50);
}

}  // namespace
}  // namespace mpf::tools
