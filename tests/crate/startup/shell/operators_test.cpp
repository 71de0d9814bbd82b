// SPDX-License-Identifier: MIT
#include "crate/startup/shell/operators.h"

#include <cstdint>
#include <gtest/gtest.h>

#include "crate/startup/shell/line_error.h"

namespace mpf::test {
namespace {

using startup::applyBinary;
using startup::applyUnary;
using startup::LineError;
using startup::Value;

Value integer(std::int64_t value) { return Value::ofInteger(value); }

TEST(OperatorsTest, CalculateAsC) {
  const auto result = [](const char* symbol, std::int64_t a, std::int64_t b) {
    return applyBinary(symbol, integer(a), integer(b), 1).integer();
  };
  EXPECT_EQ(result("-", 2, 5), -3);
  EXPECT_EQ(result("%", 7, 4), 3);
  EXPECT_EQ(result("<<", 1, 4), 16);
  EXPECT_EQ(result(">=", 4, 4), 1);
  EXPECT_EQ(result("&&", 4, 0), 0);
  EXPECT_EQ(result("^", 6, 3), 5);
  EXPECT_EQ(result("/", INT64_MIN, -1), INT64_MIN);
  EXPECT_EQ(result("+", INT64_MAX, 1), INT64_MIN);
  EXPECT_EQ(result("<<", 1, 1000), std::int64_t{1} << 40);
  EXPECT_EQ(applyBinary("*", Value::ofReal(.5), integer(3), 1).real(), 1.5);
  EXPECT_EQ(applyUnary("~", integer(0), 1).integer(), -1);
  EXPECT_EQ(applyUnary("!", integer(0), 1).integer(), 1);
}

TEST(OperatorsTest, MovePointersWithinTheirString) {
  const auto text = Value::ofString("abc");
  const auto moved = applyBinary("+", text, integer(2), 1);

  EXPECT_EQ(moved.text(), "c");
  EXPECT_EQ(applyBinary("-", moved, text, 1).integer(), 2);
  EXPECT_EQ(applyUnary("*", moved, 1).integer(), 'c');
  EXPECT_EQ(applyBinary("==", text, integer(0), 1).integer(), 0);
  EXPECT_THROW(static_cast<void>(applyBinary("+", text, integer(4), 1)), LineError);
  EXPECT_THROW(static_cast<void>(applyBinary("-", text, integer(INT64_MIN), 1)), LineError);
}

TEST(OperatorsTest, RefuseWhatHasNoResult) {
  EXPECT_THROW(static_cast<void>(applyBinary("/", integer(1), integer(0), 1)), LineError);
  EXPECT_THROW(static_cast<void>(applyBinary("%", integer(1), integer(0), 1)), LineError);
  EXPECT_THROW(static_cast<void>(applyBinary("%", Value::ofReal(1), integer(2), 1)), LineError);
  EXPECT_THROW(static_cast<void>(applyBinary("*", Value::ofString("a"), integer(2), 1)), LineError);
  EXPECT_THROW(static_cast<void>(applyBinary("+", Value::undefined("x"), integer(2), 1)),
               LineError);
  EXPECT_THROW(static_cast<void>(applyUnary("*", integer(2), 1)), LineError);
}

TEST(OperatorsTest, ResultOfAFailedCommandIsNotReportedAgain) {
  EXPECT_TRUE(applyBinary("+", Value::unavailable(), integer(1), 1).is(Value::Kind::unavailable));
}

}  // namespace
}  // namespace mpf::test
