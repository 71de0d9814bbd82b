// SPDX-License-Identifier: MIT
#include "server/programs/sniff/sniff_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string_view>

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

std::vector<SniffBytes> recordsOf(std::string_view text) {
  std::vector<SniffBytes> records;
  for (const char value : text) records.push_back({value});
  return records;
}

struct Taken {
  std::string text;
  std::uint64_t lost;
  friend bool operator==(const Taken&, const Taken&) = default;
};

Taken takeFrom(SniffQueue& queue) {
  std::vector<SniffBytes> records;
  Taken taken{{}, queue.take(records)};
  for (const auto& record : records) taken.text += record[0];
  return taken;
}

TEST(SniffQueue, ReturnsBytesInOrderOnce) {
  SniffQueue queue({});
  static_cast<void>(queue.push(recordsOf("ab")));
  static_cast<void>(queue.push(recordsOf("c")));

  EXPECT_EQ(takeFrom(queue), (Taken{"abc", 0}));
  EXPECT_EQ(takeFrom(queue), (Taken{"", 0}));
}

TEST(SniffQueue, IsDueNeverWhileEmpty) {
  SniffQueue queue({});
  EXPECT_TRUE(queue.dueAt().isNever());
  static_cast<void>(queue.push(recordsOf("a")));
  takeFrom(queue);

  EXPECT_TRUE(queue.dueAt().isNever());
}

TEST(SniffQueue, IsDueWhenItsFirstByteIsOld) {
  SniffQueue queue({.maxAge = 24h});
  const auto before = Deadline::after(24h);

  EXPECT_TRUE(queue.push(recordsOf("a")));

  const auto due = queue.dueAt();
  EXPECT_GE(due, before);
  EXPECT_LE(due, Deadline::after(24h));
  EXPECT_FALSE(queue.push(recordsOf("b")));
  EXPECT_EQ(queue.dueAt(), due);
}

TEST(SniffQueue, IsDueImmediatelyWhenLarge) {
  SniffQueue queue({.maxAge = 24h, .largeBytes = 3});
  EXPECT_TRUE(queue.push(recordsOf("a")));
  EXPECT_FALSE(queue.push(recordsOf("b")));
  EXPECT_FALSE(queue.dueAt().hasPassed());

  EXPECT_TRUE(queue.push(recordsOf("cd")));

  EXPECT_TRUE(queue.dueAt().hasPassed());
  EXPECT_FALSE(queue.push(recordsOf("e")));
}

TEST(SniffQueue, CountsBytesThatDoNotFit) {
  SniffQueue queue({.maxBytes = 4});
  static_cast<void>(queue.push(recordsOf("abc")));

  static_cast<void>(queue.push(recordsOf("defg")));
  static_cast<void>(queue.push(recordsOf("h")));

  EXPECT_EQ(takeFrom(queue), (Taken{"abcd", 4}));
  static_cast<void>(queue.push(recordsOf("i")));
  EXPECT_EQ(takeFrom(queue), (Taken{"i", 0}));
}

}  // namespace
}  // namespace mpf::test
