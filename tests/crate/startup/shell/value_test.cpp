// SPDX-License-Identifier: MIT
#include "crate/startup/shell/value.h"

#include <gtest/gtest.h>
#include <string>

namespace mpf::test {
namespace {

using startup::Value;

TEST(ValueTest, WordIsANumberWhenAllOfItIsOne) {
  EXPECT_EQ(Value::ofWord("9600").integer(), 9600);
  EXPECT_EQ(Value::ofWord("-0x10").integer(), -16);
  EXPECT_EQ(Value::ofWord("017").integer(), 15);
  EXPECT_EQ(Value::ofWord(".5").real(), .5);
  EXPECT_EQ(Value::ofWord("9600").text(), "9600");
  for (const auto* word : {"-5to5", "0x", "nan", "inf", "", "IP_a", "08"})
    EXPECT_EQ(Value::ofWord(word).integer(), std::nullopt) << word;
}

TEST(ValueTest, MissingValueIsZeroAndNoString) {
  EXPECT_EQ(Value().integer(), 0);
  EXPECT_EQ(Value().text(), std::nullopt);
}

TEST(ValueTest, PointerHasTheTextBehindIt) {
  const auto value = Value::ofString("abcd");

  EXPECT_EQ(Value::ofMemory(value.memory(), 2).text(), "cd");
  EXPECT_EQ(Value::ofMemory(value.memory(), 9).text(), "");
}

TEST(ValueTest, HandleIsReturnedWithItsType) {
  const auto value = Value::ofOpaque(std::string("board"));

  ASSERT_NE(value.opaque<std::string>(), nullptr);
  EXPECT_EQ(*value.opaque<std::string>(), "board");
  EXPECT_EQ(value.opaque<int>(), nullptr);
}

TEST(ValueTest, DescribesItself) {
  EXPECT_EQ(Value::ofInteger(7).description(), "7");
  EXPECT_EQ(Value::ofString("a").description(), "\"a\"");
  EXPECT_EQ(Value::ofAddress("ipmv162").description(), "&ipmv162");
  EXPECT_EQ(Value::undefined("x").description(), "undefined symbol x");
}

}  // namespace
}  // namespace mpf::test
