// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/sniff_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string_view>

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

std::vector<PeekedByte> bytesOf(std::string_view text) {
  std::vector<PeekedByte> bytes;
  for (const char value : text)
    bytes.push_back({0, static_cast<std::uint8_t>(value), ByteDirection::sent, LineFault::none});
  return bytes;
}

struct Taken {
  std::string text;
  std::uint64_t lost;
  friend bool operator==(const Taken&, const Taken&) = default;
};

Taken takeFrom(SniffQueue& queue) {
  std::vector<PeekedByte> bytes;
  Taken taken{{}, queue.take(bytes)};
  for (const auto& byte : bytes) taken.text += static_cast<char>(byte.value);
  return taken;
}

TEST(SniffQueue, ReturnsBytesInOrderOnce) {
  SniffQueue queue({});
  static_cast<void>(queue.push(bytesOf("ab")));
  static_cast<void>(queue.push(bytesOf("c")));

  EXPECT_EQ(takeFrom(queue), (Taken{"abc", 0}));
  EXPECT_EQ(takeFrom(queue), (Taken{"", 0}));
}

TEST(SniffQueue, IsDueNeverWhileEmpty) {
  SniffQueue queue({});
  EXPECT_TRUE(queue.dueAt().isNever());
  static_cast<void>(queue.push(bytesOf("a")));
  takeFrom(queue);

  EXPECT_TRUE(queue.dueAt().isNever());
}

TEST(SniffQueue, IsDueWhenItsFirstByteIsOld) {
  SniffQueue queue({.maxAge = 24h});
  const auto before = Deadline::after(24h);

  EXPECT_TRUE(queue.push(bytesOf("a")));

  const auto due = queue.dueAt();
  EXPECT_GE(due, before);
  EXPECT_LE(due, Deadline::after(24h));
  EXPECT_FALSE(queue.push(bytesOf("b")));
  EXPECT_EQ(queue.dueAt(), due);
}

TEST(SniffQueue, IsDueImmediatelyWhenLarge) {
  SniffQueue queue({.maxAge = 24h, .largeBytes = 3});
  EXPECT_TRUE(queue.push(bytesOf("a")));
  EXPECT_FALSE(queue.push(bytesOf("b")));
  EXPECT_FALSE(queue.dueAt().hasPassed());

  EXPECT_TRUE(queue.push(bytesOf("cd")));

  EXPECT_TRUE(queue.dueAt().hasPassed());
  EXPECT_FALSE(queue.push(bytesOf("e")));
}

TEST(SniffQueue, CountsBytesThatDoNotFit) {
  SniffQueue queue({.maxBytes = 4});
  static_cast<void>(queue.push(bytesOf("abc")));

  static_cast<void>(queue.push(bytesOf("defg")));
  static_cast<void>(queue.push(bytesOf("h")));

  EXPECT_EQ(takeFrom(queue), (Taken{"abcd", 4}));
  static_cast<void>(queue.push(bytesOf("i")));
  EXPECT_EQ(takeFrom(queue), (Taken{"i", 0}));
}

}  // namespace
}  // namespace mpf::test
