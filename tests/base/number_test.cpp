// SPDX-License-Identifier: MIT
#include "base/number.h"

#include <cstdint>
#include <gtest/gtest.h>

namespace mpf {
namespace {

TEST(Number, IsAllOfTheText) {
  EXPECT_EQ(tryNumber<int>("-12"), -12);
  EXPECT_EQ(tryNumber<double>("1.5e3"), 1500);
  EXPECT_EQ(tryNumber<std::uint64_t>("ffffffffffffffff", 16), UINT64_MAX);
  for (const auto* const text : {"", " 1", "1 ", "1x", "x", "+1", "0x1", "-"})
    EXPECT_EQ(tryNumber<int>(text), std::nullopt) << '"' << text << '"';
}

TEST(Number, IsRefusedWhenItsTypeCannotHoldIt) {
  EXPECT_EQ(tryNumber<std::uint8_t>("255"), 255);
  EXPECT_EQ(tryNumber<std::uint8_t>("256"), std::nullopt);
  EXPECT_EQ(tryNumber<unsigned>("-1"), std::nullopt);
  EXPECT_EQ(tryNumber<double>("1e999"), std::nullopt);
}

TEST(Number, IsTakenFromTheFrontOfTheText) {
  std::string_view text = "12ms";
  EXPECT_EQ(tryTakeNumber<int>(text), 12);
  EXPECT_EQ(text, "ms");

  EXPECT_EQ(tryTakeNumber<int>(text), std::nullopt);
  EXPECT_EQ(text, "ms");
}

}  // namespace
}  // namespace mpf
