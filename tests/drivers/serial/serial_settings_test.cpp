// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/serial_settings.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf {
namespace {

using testing::HasSubstr;

TEST(SerialSettings, AcceptsAllZero) { EXPECT_EQ(problemOf({}), ""); }

TEST(SerialSettings, AcceptsTheValuesOfTheManual) {
  for (const char parity : {'E', 'O', 'N'}) {
    for (const int bits : {5, 6, 7, 8}) {
      EXPECT_EQ(problemOf({.baud = 19200,
                           .stopBits = 2,
                           .bitsPerChar = bits,
                           .parity = parity,
                           .flowControl = 'H'}),
                "");
    }
  }
}

TEST(SerialSettings, ProblemNamesTheValue) {
  EXPECT_THAT(problemOf({.baud = -9600}), HasSubstr("baud -9600"));
  EXPECT_THAT(problemOf({.stopBits = 3}), HasSubstr("stop bits 3"));
  EXPECT_THAT(problemOf({.bitsPerChar = 9}), HasSubstr("bits per character 9"));
  EXPECT_THAT(problemOf({.bitsPerChar = 4}), HasSubstr("bits per character 4"));
  EXPECT_THAT(problemOf({.parity = 'X'}), HasSubstr("parity 'X'"));
  EXPECT_THAT(problemOf({.flowControl = '\x07'}), HasSubstr("flow control 0x07"));
}

TEST(SerialSettings, ZeroKeepsThePresentValue) {
  const SerialSettings before{
      .baud = 9600, .stopBits = 1, .bitsPerChar = 8, .parity = 'N', .flowControl = 'N'};

  const auto after = merged(before, {.baud = 19200, .parity = 'E'});

  EXPECT_EQ(
      after,
      (SerialSettings{
          .baud = 19200, .stopBits = 1, .bitsPerChar = 8, .parity = 'E', .flowControl = 'N'}));
}

}  // namespace
}  // namespace mpf
