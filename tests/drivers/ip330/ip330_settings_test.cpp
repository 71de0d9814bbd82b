// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>

namespace mpf::test {
namespace {

using testing::HasSubstr;
using Mode = Ip330ScanMode;

TEST(Ip330Settings, AreReadFromTheArgumentsOfTheOldCommands) {
  EXPECT_EQ(parseIp330Type("D"), Ip330Type::differential);
  EXPECT_EQ(parseIp330Type("S"), Ip330Type::singleEnded);
  EXPECT_EQ(parseIp330Range("-10to10"), Ip330Range::minus10to10);
  EXPECT_STREQ(toString(parseIp330Range("0to5")), "0to5");
  EXPECT_STREQ(dipSwitchesOf(Ip330Range::from0to10), "1011001000");
  EXPECT_EQ(parseIp330Trigger("Output"), Ip330Trigger::output);
  EXPECT_EQ(parseIp330ScanMode(3), Mode::burstContinuous);
  EXPECT_THROW(static_cast<void>(parseIp330Type("d")), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(parseIp330Range("5")), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(parseIp330Trigger("")), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(parseIp330ScanMode(6)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(parseIp330ScanMode(-1)), std::invalid_argument);
}

TEST(Ip330Settings, NameTheInvalidSetting) {
  EXPECT_EQ(Ip330Settings().problem(), "");
  EXPECT_THAT((Ip330Settings{.type = Ip330Type::differential, .lastChannel = 16}.problem()),
              HasSubstr("use 0 to 15"));
  EXPECT_THAT((Ip330Settings{.firstChannel = 5, .lastChannel = 4}.problem()),
              HasSubstr("in ascending order"));
  EXPECT_THAT((Ip330Settings{.vector = 256}.problem()), HasSubstr("use 0 to 255"));
  EXPECT_THAT((Ip330Settings{.maxClients = 0}.problem()), HasSubstr("use 1 or more"));
  EXPECT_THAT((Ip330Settings{.microsecondsPerScan = 1}.problem()), HasSubstr("us per scan"));
}

}  // namespace
}  // namespace mpf::test
