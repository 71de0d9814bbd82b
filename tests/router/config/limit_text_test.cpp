// SPDX-License-Identifier: MIT
// Limits as text: units, ranges, and conversion in both directions.
#include "router/config/limit_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::router::test {
namespace {

using namespace std::chrono_literals;

std::string complaintOfLimit(const std::string& name, const std::string& text) {
  try {
    Limits limits;
    setLimit(limits, name, text);
    return "nothing";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST(RouterLimits, HaveUnits) {
  EXPECT_EQ(parseBytes("0"), 0U);
  EXPECT_EQ(parseBytes("1500"), 1500U);
  EXPECT_EQ(parseBytes("64KiB"), 64U << 10);
  EXPECT_EQ(parseBytes("4MiB"), 4U << 20);
  EXPECT_EQ(parseBytes("1GiB"), 1U << 30);
}

// Only a command line may leave out the unit of a time.
TEST(RouterLimits, MayBeInSecondsWithoutAUnit) {
  Limits limits;

  setLimit(limits, "dead-time", "2.5", MissingUnit::seconds);
  setLimit(limits, "queue-size", "40", MissingUnit::seconds);

  EXPECT_EQ(limits.deadTime, 2500ms);
  EXPECT_EQ(limits.queueSize, 40U);
  EXPECT_NE(complaintOfLimit("dead-time", "2.5"), "nothing");
}

TEST(RouterLimits, AreWrittenAsTheyAreRead) {
  Limits changed;
  const std::vector<std::pair<std::string, std::string>> texts{
      {"queue-size", "40"},     {"buffer-size", "1500"},  {"max-message-size", "8MiB"},
      {"window-size", "65KiB"}, {"max-clients", "7"},     {"max-connections", "9"},
      {"dead-time", "1500ms"},  {"handshake-time", "3s"}, {"first-retry", "1s"},
      {"last-retry", "2min"}};
  ASSERT_EQ(texts.size(), limitNames().size());

  for (const auto& [name, text] : texts) setLimit(changed, name, text);

  EXPECT_EQ(changed, (Limits{40, 1500, 8u << 20, 65u << 10, 7, 9, 1500ms, 3s, 1s, 2min}));
  for (const auto& [name, text] : texts) EXPECT_EQ(limitText(changed, name), text);
}

// Each default value is one that a file may also contain.
TEST(RouterLimits, HaveDefaultsWithinTheirRange) {
  for (const auto& name : limitNames())
    EXPECT_EQ(complaintOfLimit(name, limitText(Limits(), name)), "nothing") << name;
}

TEST(RouterLimits, ErrorsNameTheValueAndTheForm) {
  EXPECT_EQ(complaintOfLimit("dead-time", "2"),
            "\"2\": write a time with its unit, such as 500ms, 2s or 1min");
  EXPECT_EQ(complaintOfLimit("dead-time", "2h"),
            "\"2h\": write a time with its unit, such as 500ms, 2s or 1min");
  EXPECT_EQ(complaintOfLimit("dead-time", "99ms"), "99ms is out of range: use 100ms to 60min");
  EXPECT_EQ(complaintOfLimit("last-retry", "0s"), "0s is out of range: use 1ms to 60min");
  EXPECT_EQ(complaintOfLimit("buffer-size", "4MB"),
            "\"4MB\": write a size in bytes, or with its unit: 4096, 64KiB, 4MiB, 1GiB");
  EXPECT_EQ(complaintOfLimit("buffer-size", "-1"),
            "\"-1\": write a size in bytes, or with its unit: 4096, 64KiB, 4MiB, 1GiB");
  EXPECT_EQ(complaintOfLimit("buffer-size", "1GiB"), "1GiB is out of range: use 256 to 64MiB");
  EXPECT_EQ(complaintOfLimit("buffer-size", "99999999999GiB"),
            "\"99999999999GiB\": write a size in bytes, or with its unit: 4096, 64KiB, 4MiB, 1GiB");
  EXPECT_EQ(complaintOfLimit("queue-size", "0"), "0 is out of range: use 1 to 1000000");
  EXPECT_EQ(complaintOfLimit("queue-size", "many"), "\"many\": write a number");
  EXPECT_EQ(complaintOfLimit("max-clients", "16385"), "16385 is out of range: use 1 to 16384");
}

}  // namespace
}  // namespace mpf::router::test
