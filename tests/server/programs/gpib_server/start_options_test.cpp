// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/start_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/programs/command_line.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class GpibStartOptionsTest : public testing::Test {
 protected:
  std::optional<int> parse(const std::vector<std::string>& words) {
    return statusOf([&](int argc, char** argv) { return options_.parse(argc, argv); }, words);
  }
  std::string refusal(const std::vector<std::string>& words) {
    return usageErrorOf([&](int argc, char** argv) { return options_.parse(argc, argv); }, words);
  }
  GpibStartOptions options_;
};

TEST_F(GpibStartOptionsTest, TheArgumentsAreThoseOfTheOldCommand) {
  ASSERT_EQ(
      parse({"GPIB0", "a-ip488", "1024", "1000", "--ti9914", "a-ip488,ipac,IP_a,105", "--timeout",
             "5", "--max-timeout", "6s", "--max-lease", "1500ms", "--poll-timeout", "250ms"}),
      std::nullopt);

  EXPECT_EQ(options_.server, "GPIB0");
  EXPECT_EQ(options_.module, "a-ip488");
  EXPECT_EQ(options_.limits.bufferBytes, 1024U);
  EXPECT_EQ(options_.arguments.messages.queueSize, 1000);
  EXPECT_EQ(options_.limits.timeout, 5s);
  EXPECT_EQ(options_.limits.maxTimeout, 6s);
  EXPECT_EQ(options_.limits.maxLease, 1500ms);
  EXPECT_EQ(options_.limits.pollTimeout, 250ms);
  EXPECT_NE(options_.ti9914.find("a-ip488"), nullptr);
}

TEST_F(GpibStartOptionsTest, SizesHaveDefaults) {
  ASSERT_EQ(parse({"GPIB0", "prologix:gpib1:1234"}), std::nullopt);

  EXPECT_EQ(options_.limits.bufferBytes, 4096U);
  EXPECT_EQ(options_.arguments.messages.queueSize, 20);
}

TEST_F(GpibStartOptionsTest, WrongArgumentsAreUsageErrors) {
  EXPECT_THAT(refusal({}), HasSubstr("server is required"));
  EXPECT_THAT(refusal({"GPIB0"}), HasSubstr("module is required"));
  EXPECT_THAT(refusal({"GPIB0", "usbtmc:/dev/usbtmc0", "0"}), HasSubstr("bufsize"));
  EXPECT_THAT(refusal({"GPIB0", "usbtmc:/dev/usbtmc0", "9", "9", "--max-lease", "0"}),
              HasSubstr("--max-lease"));
}

TEST_F(GpibStartOptionsTest, AModuleThatTheServerDoesNotUseIsAnError) {
  EXPECT_THAT(refusal({"GPIB0", "a-ip488", "--ti9914", "b-ip488,ipac,IP_a"}),
              HasSubstr("--ti9914: b-ip488: the server uses \"a-ip488\""));
}

}  // namespace
}  // namespace mpf::test
