// SPDX-License-Identifier: MIT
#include "server/programs/digital_io_server/start_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/programs/command_line.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class DigitalIoStartOptionsTest : public testing::Test {
 protected:
  // Words behind the name, carrier and site of the module.
  void parse(const std::vector<std::string>& words) {
    EXPECT_EQ(statusOf(parser(), withModule(words)), std::nullopt);
  }
  std::string complaint(const std::vector<std::string>& words) {
    return usageErrorOf(parser(), withModule(words));
  }

  DigitalIoStartOptions options_;

 private:
  static std::vector<std::string> withModule(std::vector<std::string> words) {
    words.insert(words.begin(), {"dio", "ipac", "IP_b"});
    return words;
  }
  // The program parses once, so each call starts with new options.
  std::function<std::optional<int>(int, char**)> parser() {
    return [this](int argc, char** argv) {
      Hardware hardware;
      options_ = {};
      return options_.parse(argc, argv, hardware);
    };
  }
};

TEST_F(DigitalIoStartOptionsTest, HaveTheDefaultsOfTheOldCommand) {
  parse({});

  EXPECT_EQ(options_.place.name, "dio");
  EXPECT_EQ(options_.place.carrier, "ipac");
  EXPECT_EQ(options_.place.site, "IP_b");
  EXPECT_EQ(options_.io.pollEvery, 100ms);
  EXPECT_EQ(options_.io.vector, 0);
  EXPECT_EQ(options_.io.rising, 0U);
  EXPECT_EQ(options_.io.falling, 0U);
  ASSERT_NE(options_.kind, nullptr);
  EXPECT_EQ(options_.kind->name, "IP-Unidig-I");
}

TEST_F(DigitalIoStartOptionsTest, HaveTheOrderOfTheOldCommand) {
  parse({"30", "250", "116", "0x0f", "0xf0", "0", "5"});

  EXPECT_EQ(options_.arguments.messages.queueSize, 30U);
  EXPECT_EQ(options_.io.pollEvery, 250ms);
  EXPECT_EQ(options_.io.vector, 116);
  EXPECT_EQ(options_.io.rising, 0x0fU);
  EXPECT_EQ(options_.io.falling, 0xf0U);
  EXPECT_EQ(options_.maxClients, 5);
}

TEST_F(DigitalIoStartOptionsTest, APollTimeOf0IsTheDefault) {
  parse({"20", "0"});

  EXPECT_EQ(options_.io.pollEvery, 100ms);
}

TEST_F(DigitalIoStartOptionsTest, BitsOfTheLastMaskInterruptOnBothEdges) {
  parse({"20", "100", "116", "0x1", "0x2", "0x0c"});

  EXPECT_EQ(options_.io.rising, 0x0dU);
  EXPECT_EQ(options_.io.falling, 0x0eU);
}

TEST_F(DigitalIoStartOptionsTest, AModelHasTheKindOfItsOption) {
  parse({"--kind", "IP-Unidig-HV-8I16O"});

  EXPECT_EQ(options_.kind->name, "IP-Unidig-HV-8I16O");
}

TEST_F(DigitalIoStartOptionsTest, RefuseInvalidValues) {
  EXPECT_THAT(complaint({"20", "3600001"}), HasSubstr("3600001 is out of range: use 0 to 3600000"));
  EXPECT_THAT(complaint({"20", "100", "256"}), HasSubstr("256 is out of range: use 0 to 255"));
  EXPECT_THAT(complaint({"--kind", "IP-Unidig-T"}),
              HasSubstr("unknown kind \"IP-Unidig-T\"; the kinds are IP-Unidig-E, IP-Unidig, "));
}

TEST_F(DigitalIoStartOptionsTest, NameTheModuleThatIsMissing) {
  Hardware hardware;
  const auto parse = [&](int argc, char** argv) { return options_.parse(argc, argv, hardware); };

  EXPECT_THAT(usageErrorOf(parse, {"dio", "ipac"}), HasSubstr("site is required"));
}

}  // namespace
}  // namespace mpf::test
