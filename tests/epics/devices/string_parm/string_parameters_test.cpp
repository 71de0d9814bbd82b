// SPDX-License-Identifier: MIT
#include "epics/devices/string_parm/string_parameters.h"

#include <gtest/gtest.h>
#include <stdexcept>

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using namespace std::string_literals;

StringParameters parsed(std::string_view text) { return StringParameters::parse(text, 7, 1000ms); }

TEST(StringParameters, HaveDefaults) {
  const auto parameters = parsed("");

  EXPECT_EQ(parameters.terminator, "\r\n");
  EXPECT_EQ(parameters.index, 7U);
  EXPECT_EQ(parameters.timeout, 1000ms);
  EXPECT_EQ(parameters.maxBytes, 100);
  EXPECT_FALSE(parameters.format);
}

TEST(StringParameters, AreReadInAnyOrder) {
  const auto parameters = parsed("1STR=on,N=10,0STR=off,FMT=PA 1 %f,IX=3,TO=250,TERM=0a");

  EXPECT_EQ(parameters.terminator, "\n");
  EXPECT_EQ(parameters.index, 3U);
  EXPECT_EQ(parameters.timeout, 250ms);
  EXPECT_EQ(parameters.maxBytes, 10);
  EXPECT_EQ(parameters.format, "PA 1 %f");
  EXPECT_EQ(parameters.zero, "off");
  EXPECT_EQ(parameters.one, "on");
}

TEST(StringParameters, TerminatorEndsAtTheFirstOtherCharacter) {
  EXPECT_EQ(parsed("TERM=ok>").terminator, "");
  EXPECT_EQ(parsed("TERM=,TO=1").terminator, "");
  EXPECT_EQ(parsed("TERM=0d0D0a").terminator, "\r\r\n");
  EXPECT_EQ(parsed("TERM=0d0").terminator, "\r");
  EXPECT_EQ(parsed("TERM=00").terminator, "\0"s);
  EXPECT_EQ(parsed("TERM=01010101010101010101").terminator.size(), 9U);
}

TEST(StringParameters, AKeyIsFoundInsideAnotherWord) {
  EXPECT_EQ(parsed("FMT=GOTO=5 %d,TO=9").timeout, 5ms);
  EXPECT_EQ(parsed("SCAN=4").maxBytes, 4);
}

TEST(StringParameters, TextInsteadOfANumberIsZero) {
  EXPECT_EQ(parsed("IX=x").index, 0U);
  EXPECT_EQ(parsed("TO=").timeout, 0ms);
  EXPECT_EQ(parsed("TO=-5").timeout, 0ms);
  EXPECT_EQ(parsed("N= 12x").maxBytes, 12);
}

TEST(StringParameters, ANegativeIndexIsRefused) {
  EXPECT_THROW(parsed("IX=-1"), std::invalid_argument);
}

TEST(StringParameters, TakeTheTextOfAnAnswer) {
  const auto parameters = parsed("IX=2");

  EXPECT_EQ(parameters.textOf("V=12\r\n"), "12");
  EXPECT_EQ(parameters.textOf("V=12"), "12") << "ended by N or the timeout";
  EXPECT_EQ(parameters.textOf("\r\n1"), "1");
  EXPECT_EQ(parameters.textOf("ab\r\n"), "");
  EXPECT_EQ(parameters.textOf("a\r\n"), "") << "the index is in the terminator";
  EXPECT_EQ(parameters.textOf("ab1\0002"s), "1") << "a zero byte ends the text";
  EXPECT_FALSE(parameters.textOf("ab"));
  EXPECT_FALSE(parameters.textOf(""));
}

TEST(StringParameters, RemoveTheTwoBytesAtWhichTheServerEndsTheAnswer) {
  const auto parameters = parsed("IX=0,TERM=0d0d0a");

  EXPECT_EQ(parameters.textOf("12\r\r\n"), "12");
  EXPECT_EQ(parameters.textOf("12\r\r"), "12");
}

}  // namespace
}  // namespace mpf::test
