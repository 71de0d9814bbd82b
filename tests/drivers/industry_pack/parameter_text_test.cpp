// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/parameter_text.h"

#include <functional>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

// The error of `read`, which must throw one.
IndustryPackError errorOf(const std::function<void()>& read) {
  try {
    read();
  } catch (const IndustryPackError& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {IndustryPackStatus::badTable, ""};
}

TEST(ParameterText, IsReadFromLeftToRight) {
  ParameterText text("Board", " 6000, 5 R=0x10");
  EXPECT_EQ(text.hex("address"), 0x6000U);
  text.expect(',', "address");
  EXPECT_EQ(text.level("level"), 5);
  EXPECT_EQ(text.word(), "R");
  text.expect('=', "R");
  EXPECT_FALSE(text.atEnd());
  EXPECT_EQ(text.number("size"), 16U);
  EXPECT_TRUE(text.atEnd());
  EXPECT_EQ(text.peek(), '\0');
  text.expectEnd();
}

TEST(ParameterText, HasNumbersOfBothBases) {
  ParameterText text("Board", "0XfF ff 0x10 10 4294967295");
  EXPECT_EQ(text.hex("first"), 255U);
  EXPECT_EQ(text.hex("second"), 255U);
  EXPECT_EQ(text.number("third"), 16U);
  EXPECT_EQ(text.number("fourth"), 10U);
  EXPECT_EQ(text.number("fifth"), UINT32_MAX);
}

TEST(ParameterText, TakesOnlyWhatIsAsked) {
  ParameterText text("Board", "abc,x,1");
  EXPECT_FALSE(text.trySkip(','));
  EXPECT_EQ(text.word(), "abc");
  EXPECT_EQ(text.word(), "");
  EXPECT_FALSE(text.trySkipBeforeNumber(','));
  EXPECT_EQ(text.rest(), ",x,1");
  EXPECT_TRUE(text.trySkip(','));
  EXPECT_EQ(text.take(), 'x');
  EXPECT_TRUE(text.trySkipBeforeNumber(','));
  EXPECT_EQ(text.rest(), "1");
}

TEST(ParameterText, AcceptsBothEndsOfTheLimits) {
  const ParameterLimits limits{.multipleOf = 0x400, .least = 0x400, .most = 0xfc00};
  ParameterText text("Board", "400 fc00");
  EXPECT_EQ(text.hex("address", limits), 0x400U);
  EXPECT_EQ(text.hex("address", limits), 0xfc00U);
}

TEST(ParameterText, NamesTheLimitsInTheBaseOfTheNumber) {
  const ParameterLimits limits{.multipleOf = 0x10, .least = 0x10, .most = 0x80};
  for (const auto* const invalid : {"0", "18", "90"}) {
    ParameterText text("Board", invalid);
    EXPECT_EQ(errorOf([&] { static_cast<void>(text.hex("address", limits)); }).what(),
              std::string("Board \"") + invalid + "\": address " +
                  (invalid == std::string("0") ? "0x0" : std::string("0x") + invalid) +
                  ": use a multiple of 0x10, 0x10 to 0x80");
  }
  ParameterText text("Board", "22");
  EXPECT_STREQ(errorOf([&] { static_cast<void>(text.number("slot", {.most = 21})); }).what(),
               "Board \"22\": slot 22: use 0 to 21");
}

TEST(ParameterText, RefusesANumberThatIsTooLong) {
  ParameterText text("Board", "4294967296,1");
  EXPECT_STREQ(errorOf([&] { static_cast<void>(text.number("size")); }).what(),
               "Board \"4294967296,1\": size 4294967296: use 0 to 4294967295");
}

TEST(ParameterText, NamesAMissingPart) {
  ParameterText text("Board", "1 x");
  EXPECT_EQ(text.number("slot"), 1U);
  EXPECT_STREQ(errorOf([&] { text.expect(',', "slot"); }).what(),
               "Board \"1 x\": expected ',' after the slot, found \"x\"");
  EXPECT_STREQ(errorOf([&] { static_cast<void>(text.number("level")); }).what(),
               "Board \"1 x\": the level is not a number: \"x\"");
  EXPECT_STREQ(errorOf([&] { text.expectEnd(); }).what(),
               "Board \"1 x\": unexpected \"x\" at the end");
  ParameterText empty("Board", " ");
  EXPECT_STREQ(errorOf([&] { static_cast<void>(empty.number("slot")); }).what(),
               "Board \" \": the slot is missing");
}

TEST(ParameterText, GivesInvalidLevelsAStatusOfTheirOwn) {
  ParameterText text("Board", "0 7 8");
  EXPECT_EQ(text.level("level"), 0);
  EXPECT_EQ(text.level("level"), 7);
  const auto error = errorOf([&] { static_cast<void>(text.level("level")); });
  EXPECT_EQ(error.status(), IndustryPackStatus::badIntLevel);
  EXPECT_STREQ(error.what(), "Board \"0 7 8\": level 8: use 1 to 7, or 0 for no interrupt");
  EXPECT_EQ(errorOf([&] { text.refuse("no"); }).status(), IndustryPackStatus::badAddress);
}

}  // namespace
}  // namespace mpf::test
