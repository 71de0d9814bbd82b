// SPDX-License-Identifier: MIT
#include "base/time_text.h"

#include <gtest/gtest.h>

namespace mpf {
namespace {

using namespace std::chrono_literals;

TEST(TimeText, HasANumberAndAUnit) {
  EXPECT_EQ(tryTime("200ms"), 200ms);
  EXPECT_EQ(tryTime("2s"), 2s);
  EXPECT_EQ(tryTime("1.5min"), 90s);
  EXPECT_EQ(tryTime("0.25ms"), 250us);
  EXPECT_EQ(tryTime("0ms"), 0ns);
  for (const auto* const text : {"", "5", "s", "-1s", "1h", "1 s", "2s ", "1e300s", "nans", "infs"})
    EXPECT_EQ(tryTime(text), std::nullopt) << '"' << text << '"';
}

TEST(TimeText, MayMeanSecondsWithoutAUnit) {
  EXPECT_EQ(tryTime("2", MissingUnit::seconds), 2s);
  EXPECT_EQ(tryTime("0.05", MissingUnit::seconds), 50ms);
  EXPECT_EQ(tryTime("2ms", MissingUnit::seconds), 2ms);
  for (const auto* const text : {"", "s", "-1", "soon", "nan", "inf"})
    EXPECT_EQ(tryTime(text, MissingUnit::seconds), std::nullopt) << '"' << text << '"';
}

TEST(TimeText, HasAnUpperLimit) {
  EXPECT_EQ(tryTime("1000000000s"), kLongestTime);
  EXPECT_EQ(tryTime("1000000001s"), std::nullopt);
}

TEST(TimeText, IsWrittenAsItIsRead) {
  for (const auto* const text : {"0s", "1ms", "1500ms", "3s", "2min", "90s", "0.25ms"})
    EXPECT_EQ(timeText(tryTime(text).value()), text);
  EXPECT_EQ(timeText(60s), "1min");
  EXPECT_EQ(timeText(1000ms), "1s");
}

}  // namespace
}  // namespace mpf
