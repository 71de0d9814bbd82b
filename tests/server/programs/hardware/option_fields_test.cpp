// SPDX-License-Identifier: MIT
#include "server/programs/hardware/option_fields.h"

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using testing::HasSubstr;

std::string complaintOf(const std::string& text, const std::function<void(OptionFields&)>& take) {
  try {
    OptionFields fields("--scan", text);
    take(fields);
    fields.end();
  } catch (const CLI::ValidationError& error) {
    return error.what();
  }
  return {};
}

TEST(OptionFieldsTest, AreTakenOneAfterTheOther) {
  OptionFields fields("--scan", "adc,-3,E");
  EXPECT_EQ(fields.word("name"), "adc");
  EXPECT_EQ(fields.number("first"), -3);
  EXPECT_EQ(fields.letter("parity", 'N'), 'E');
  fields.end();
}

TEST(OptionFieldsTest, LeftOutOrEmptyHaveTheirDefault) {
  OptionFields fields("--scan", "adc,,,5");
  EXPECT_EQ(fields.word("name"), "adc");
  EXPECT_EQ(fields.number("first", 7), 7);
  EXPECT_EQ(fields.word("mode", "fast"), "fast");
  EXPECT_EQ(fields.number("last", 8), 5);
  EXPECT_EQ(fields.letter("parity", 'N'), 'N');
  EXPECT_EQ(fields.queueSize(), OptionFields::kDefaultQueueSize);
  fields.end();
}

TEST(OptionFieldsTest, SayWhatIsWrong) {
  EXPECT_THAT(complaintOf("", [](OptionFields& fields) { static_cast<void>(fields.word("name")); }),
              HasSubstr("--scan: : name is missing"));
  EXPECT_THAT(
      complaintOf("1x", [](OptionFields& fields) { static_cast<void>(fields.number("first")); }),
      HasSubstr("first \"1x\" is not a whole number"));
  EXPECT_THAT(complaintOf("0", [](OptionFields& fields) { static_cast<void>(fields.queueSize()); }),
              HasSubstr("queue size 0: use 1 to 16384"));
  EXPECT_THAT(
      complaintOf("a,b", [](OptionFields& fields) { static_cast<void>(fields.word("name")); }),
      HasSubstr("unexpected field \"b\""));
}

}  // namespace
}  // namespace mpf::test
