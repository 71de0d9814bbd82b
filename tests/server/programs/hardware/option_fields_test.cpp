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
    OptionFields words("--scan", text);
    take(words);
    words.end();
  } catch (const CLI::ValidationError& error) {
    return error.what();
  }
  return {};
}

TEST(WordsTest, AreTakenOneAfterTheOther) {
  OptionFields words("--scan", "adc,-3,E");
  EXPECT_EQ(words.word("name"), "adc");
  EXPECT_EQ(words.number("first"), -3);
  EXPECT_EQ(words.letter("parity", 'N'), 'E');
  words.end();
}

TEST(WordsTest, LeftOutOrEmptyHaveTheirDefault) {
  OptionFields words("--scan", "adc,,,5");
  EXPECT_EQ(words.word("name"), "adc");
  EXPECT_EQ(words.number("first", 7), 7);
  EXPECT_EQ(words.word("mode", "fast"), "fast");
  EXPECT_EQ(words.number("last", 8), 5);
  EXPECT_EQ(words.letter("parity", 'N'), 'N');
  EXPECT_EQ(words.queueSize(), OptionFields::kDefaultQueueSize);
  words.end();
}

TEST(WordsTest, SayWhatIsWrong) {
  EXPECT_THAT(complaintOf("", [](OptionFields& words) { static_cast<void>(words.word("name")); }),
              HasSubstr("--scan: : name is missing"));
  EXPECT_THAT(
      complaintOf("1x", [](OptionFields& words) { static_cast<void>(words.number("first")); }),
      HasSubstr("first \"1x\" is not a whole number"));
  EXPECT_THAT(complaintOf("0", [](OptionFields& words) { static_cast<void>(words.queueSize()); }),
              HasSubstr("queue size 0: use 1 to 16384"));
  EXPECT_THAT(
      complaintOf("a,b", [](OptionFields& words) { static_cast<void>(words.word("name")); }),
      HasSubstr("unexpected field \"b\""));
}

}  // namespace
}  // namespace mpf::test
