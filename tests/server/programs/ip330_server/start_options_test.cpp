// SPDX-License-Identifier: MIT
#include "server/programs/ip330_server/start_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/programs/command_line.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class Ip330StartOptionsTest : public testing::Test {
 protected:
  // Words behind the name, carrier and site of the module.
  void parse(const std::vector<std::string>& words) {
    EXPECT_EQ(statusOf(parser(), withModule(words)), std::nullopt);
  }
  std::string complaint(const std::vector<std::string>& words) {
    return usageErrorOf(parser(), withModule(words));
  }

  Ip330StartOptions options_;

 private:
  static std::vector<std::string> withModule(std::vector<std::string> words) {
    words.insert(words.begin(), {"adc", "ipac", "IP_a"});
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

TEST_F(Ip330StartOptionsTest, WithoutServersAreThoseOfTheModulesName) {
  parse({});

  ASSERT_THAT(options_.scans, SizeIs(1));
  EXPECT_EQ(options_.scans[0].name, "adc");
  EXPECT_EQ(options_.scans[0].first, 0);
  EXPECT_EQ(options_.scans[0].last, 15);
  EXPECT_EQ(options_.scans[0].averageMs, 0);
  EXPECT_EQ(options_.scans[0].queueSize, 20);
  ASSERT_THAT(options_.configs, SizeIs(1));
  EXPECT_EQ(options_.configs[0].name, "adcConfig");
  EXPECT_THAT(options_.sweeps, IsEmpty());
  EXPECT_THAT(options_.pids, IsEmpty());
}

TEST_F(Ip330StartOptionsTest, HaveTheDefaultsOfTheOldCommands) {
  parse({});

  EXPECT_EQ(options_.settings.type, Ip330Type::singleEnded);
  EXPECT_EQ(options_.settings.range, Ip330Range::minus5to5);
  EXPECT_EQ(options_.settings.scanMode, Ip330ScanMode::burstContinuous);
  EXPECT_EQ(options_.settings.trigger, Ip330Trigger::input);
}

TEST_F(Ip330StartOptionsTest, HaveTheOrderOfTheOldCommand) {
  parse({"D", "0to10", "2", "9", "4", "120", "--scan-mode", "1", "--trigger", "Output",
         "--us-per-scan", "2500", "--seconds-between-calibrate", "-1"});

  EXPECT_EQ(options_.place.name, "adc");
  EXPECT_EQ(options_.settings.type, Ip330Type::differential);
  EXPECT_EQ(options_.settings.range, Ip330Range::from0to10);
  EXPECT_EQ(options_.settings.firstChannel, 2);
  EXPECT_EQ(options_.settings.lastChannel, 9);
  EXPECT_EQ(options_.settings.maxClients, 4);
  EXPECT_EQ(options_.settings.vector, 120);
  EXPECT_EQ(options_.settings.scanMode, Ip330ScanMode::uniformContinuous);
  EXPECT_EQ(options_.settings.trigger, Ip330Trigger::output);
  EXPECT_EQ(options_.settings.microsecondsPerScan, 2500);
  EXPECT_EQ(options_.settings.secondsBetweenCalibrate, -1);
}

TEST_F(Ip330StartOptionsTest, AServerThatIsAskedForReplacesTheUsualOnes) {
  parse({"--sweep", "wave,1,4,2048,7"});

  EXPECT_THAT(options_.scans, IsEmpty());
  EXPECT_THAT(options_.configs, IsEmpty());
  ASSERT_THAT(options_.sweeps, SizeIs(1));
  EXPECT_EQ(options_.sweeps[0].name, "wave");
  EXPECT_EQ(options_.sweeps[0].first, 1);
  EXPECT_EQ(options_.sweeps[0].last, 4);
  EXPECT_EQ(options_.sweeps[0].maxPoints, 2048);
  EXPECT_EQ(options_.sweeps[0].queueSize, 7);
}

TEST_F(Ip330StartOptionsTest, AScanWithoutChannelsHasThoseOfTheBoard) {
  parse({"S", "-5to5", "3", "12", "--scan", "all", "--scan", "some,4,6,100,9"});

  ASSERT_THAT(options_.scans, SizeIs(2));
  EXPECT_EQ(options_.scans[0].first, 3);
  EXPECT_EQ(options_.scans[0].last, 12);
  EXPECT_EQ(options_.scans[1].first, 4);
  EXPECT_EQ(options_.scans[1].last, 6);
  EXPECT_EQ(options_.scans[1].averageMs, 100);
  EXPECT_EQ(options_.scans[1].queueSize, 9);
}

TEST_F(Ip330StartOptionsTest, FeedbackNamesItsDac) {
  parse({"--dac", "dac,ipac,IP_b", "--pid", "loop,5,dac,2"});

  ASSERT_THAT(options_.dacs, SizeIs(1));
  EXPECT_EQ(options_.dacs[0].name, "dac");
  EXPECT_EQ(options_.dacs[0].site, "IP_b");
  ASSERT_THAT(options_.pids, SizeIs(1));
  EXPECT_EQ(options_.pids[0].channel, 5);
  EXPECT_EQ(options_.pids[0].dac, "dac");
  EXPECT_EQ(options_.pids[0].dacChannel, 2);
  EXPECT_EQ(options_.pids[0].queueSize, 20);
}

TEST_F(Ip330StartOptionsTest, RefuseWhatTheBoardDoesNotHave) {
  EXPECT_THAT(complaint({"X"}), HasSubstr("type \"X\": use D"));
  EXPECT_THAT(complaint({"S", "-3to3"}), HasSubstr("range \"-3to3\": use -5to5"));
  EXPECT_THAT(complaint({"D", "0to5", "0", "16"}), HasSubstr("use 0 to 15"));
  EXPECT_THAT(complaint({"--scan-mode", "7"}), HasSubstr("scan mode 7"));
  EXPECT_THAT(complaint({"--trigger", "in"}), HasSubstr("use Input or Output"));
  EXPECT_THAT(complaint({"--pid", "p,0,dac,2"}), HasSubstr("--pid p: no --dac has the name dac"));
  EXPECT_THAT(complaint({"--dac", "d,ipac,IP_b", "--pid", "p,16,d,2"}),
              HasSubstr("--pid p: channel 16: the board scans 0 to 15"));
}

TEST_F(Ip330StartOptionsTest, RefuseInvalidFields) {
  EXPECT_THAT(complaint({"--scan", "a,0"}), HasSubstr("last channel is missing"));
  EXPECT_THAT(complaint({"--scan", "a,-1,5"}), HasSubstr("first channel -1: use 0 or more"));
  EXPECT_THAT(complaint({"--scan", "a,0,-5"}), HasSubstr("last channel -5: use 0 or more"));
  EXPECT_THAT(complaint({"--scan", "a,0,15,-100"}),
              HasSubstr("averaging time -100: use 0 or more"));
  EXPECT_THAT(complaint({"--sweep", "a,0,1"}), HasSubstr("points is missing"));
  EXPECT_THAT(complaint({"--config", "a,1,2"}), HasSubstr("unexpected field \"2\""));
  EXPECT_THAT(complaint({"--dac", "d,ipac"}), HasSubstr("site is missing"));
}

}  // namespace
}  // namespace mpf::test
