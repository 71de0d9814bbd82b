// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_signals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>

namespace mpf::test {
namespace {

TEST(Ip330Signals, AreReadFromText) {
  const auto signals = parseIp330Signals("0=dc:1.5,1=sine:5:10,31=sine:50:1:-2.5");

  ASSERT_EQ(signals.size(), 3u);
  EXPECT_DOUBLE_EQ(signals.at(0)(12), 1.5);
  EXPECT_NEAR(signals.at(1)(0.05), 10, 1e-9);
  EXPECT_NEAR(signals.at(1)(0.1), 0, 1e-9);
  EXPECT_NEAR(signals.at(31)(0.005), -1.5, 1e-9);
}

TEST(Ip330Signals, CanBeOfOtherKinds) {
  const auto signals = parseIp330Signals(
      "3=wire:a",
      {{"wire", [](const std::string& name) { return dcSignal(name == "a" ? 7 : 0); }}});
  EXPECT_DOUBLE_EQ(signals.at(3)(0), 7);
}

TEST(Ip330Signals, NameTheInvalidPart) {
  for (const auto* const text :
       {"", "0", "0=", "0=dc", "0=dc:x", "0=dc:1x", "0=dc:nan", "0=sine:inf:1", "32=dc:1",
        "-1=dc:1", "x=dc:1", "0=sine:5", "0=sine:1:2:3:4", "0=square:1", "0=dc:1,"}) {
    EXPECT_THROW(static_cast<void>(parseIp330Signals(text)), std::invalid_argument) << text;
  }
}

}  // namespace
}  // namespace mpf::test
