// SPDX-License-Identifier: MIT
// mpf-ip330-server as a process.
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdio.h>

#include <mpf/ip330_commands.h>
#include <mpf/sync_client.h>

#include "tests/support/command.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

class Ip330ProgramTest : public testing::Test {
 protected:
  std::unique_ptr<Program> start(const std::vector<std::string>& options) {
    std::vector<std::string> command{MPF_TEST_IP330_SERVER, "--backplane", backplane_.name()};
    command.insert(command.end(), options.begin(), options.end());
    return std::make_unique<Program>(command);
  }
  Int32 read(const std::string& server, std::int32_t channel, std::int32_t gain = 0) {
    SyncClient client(backplane_, server);
    auto answer = client.call(Int32Message({.address = channel, .value = gain}), 60s);
    EXPECT_TRUE(answer) << answer.why();
    const auto reply = answer.as<Int32>();
    return reply ? **reply : Int32{.status = -99};
  }
  Watchdog watchdog_{"ip330 program test"};
  TestBackplane backplane_;
};

TEST_F(Ip330ProgramTest, ServesScansUnderTheModulesNameAsRelease1Dash4) {
  const auto server = start({"adc", "ipac", "IP_a", "D", "-5to5", "0", "15", "10", "120",
                             "--carrier", "ipac=model", "--signal", "3=dc:-2.5,4=sine:5:1"});

  const auto reply = read("adc", 3);

  EXPECT_EQ(reply.status, 0);
  EXPECT_NEAR(reply.value, 16384, 6);
  EXPECT_EQ(read("adc", 16).status, -1);
  EXPECT_EQ(read("adcConfig", 0, 60).status, 0);
  const auto status = server->end(SIGTERM);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_THAT(server->errors(),
              AllOf(HasSubstr("serving the Acromag IP330 at carrier ipac, site IP_a (channels 0 to "
                              "15, -5to5 V, burstContinuous, 1000 us"),
                    HasSubstr(R"(as "adc", "adcConfig")"), HasSubstr("stopped")));
}

TEST_F(Ip330ProgramTest, ServesAllRequestedServersOfOneBoard) {
  const auto server =
      start({"--scan", "s1,0,3,100,30", "--scan", "s2,4,7", "--config", "c", "--sweep", "w,0,1,50",
             "--pid", "p,0,dac,2,25", "--dac", "dac,ipac,IP_b", "adc", "ipac", "IP_a", "S", "0to10",
             "--carrier", "ipac=model"});

  EXPECT_EQ(read("s1", 3).status, 0);
  EXPECT_EQ(read("s1", 4).status, -1);
  EXPECT_EQ(read("s2", 4).status, 0);
  SyncClient sweep(backplane_, "w");
  auto points = sweep.call(Float64Message({.cmd = ip330server::msgRead}), 60s).as<Int32Array>();
  ASSERT_TRUE(points);
  EXPECT_EQ(points->value().size(), 50u);
  SyncClient pid(backplane_, "p");
  auto params =
      pid.call(Float64Message({.cmd = ip330server::cmdGetParams}), 60s).as<Float64Array>();
  ASSERT_TRUE(params);
  EXPECT_EQ((*params)->status, 0);
  EXPECT_EQ(server->end(SIGINT), 0);
}

TEST_F(Ip330ProgramTest, FeedsBackThroughAWireFromTheDacToTheAdc) {
  const TemporaryFolder folder;
  const auto server = start({"adc", "ipac", "IP_a", "S", "-10to10", "--carrier", "ipac=model",
                             "--wires", folder.path() / "wires", "--dac", "dac,ipac,IP_b", "--pid",
                             "p,0,dac,2", "--signal", "0=wire:dac.2"});
  SyncClient pid(backplane_, "p");
  const auto tell = [&](std::int32_t command, double value) {
    const auto reply =
        pid.call(Float64Message({.cmd = command, .value = value}), 60s).as<Float64>();
    return reply ? (*reply)->status : -99;
  };
  const auto actual = [&] {
    const auto reply =
        pid.call(Float64Message({.cmd = ip330server::cmdGetParams}), 60s).as<Float64Array>();
    return reply ? reply->value()[ip330server::offsetActual] : 0;
  };

  EXPECT_EQ(tell(ip330server::cmdSetKP, 0.01), 0);
  EXPECT_EQ(tell(ip330server::cmdSetKI, 100), 0);
  EXPECT_EQ(tell(ip330server::cmdSetSetPoint, 40000), 0);
  EXPECT_EQ(tell(ip330server::cmdStartFeedback, 0), 0);

  while (std::abs(actual() - 40000) > 20) {
  }
  EXPECT_EQ(server->end(SIGTERM), 0);
}

// A DAC on a PCI board that does not exist.
TEST_F(Ip330ProgramTest, ServesScansWhileItWaitsForADac) {
  const auto server = start({"adc", "ipac", "IP_a", "--carrier", "ipac=model", "--carrier",
                             "pci=tpci200:ffff:ff:1f.7", "--wait", "--scan", "s", "--config", "c",
                             "--dac", "dac,pci,IP_b", "--pid", "p,0,dac,2"});

  EXPECT_EQ(read("s", 3).status, 0);

  EXPECT_EQ(server->end(SIGTERM), 0);
  EXPECT_THAT(server->errors(), AllOf(HasSubstr(R"(as "s", "c")"),
                                      HasSubstr("waiting for the board"), HasSubstr("stopped")));
}

TEST_F(Ip330ProgramTest, ShowsTheOldCommandsInItsHelp) {
  EXPECT_THAT(
      runCommand(std::string(MPF_TEST_IP330_SERVER) + " --help").output,
      AllOf(
          HasSubstr(
              R"(initIp330("module", "carrier", "site", "type", "range", first, last, maxclients, vector))"),
          HasSubstr(
              R"(configIp330(ip330, scanMode, "trigger", usPerScan, secondsBetweenCalibrate))"),
          HasSubstr(R"(initIp330Scan(ip330, "server", first, last, msToAverage, queuesize))"),
          HasSubstr(
              R"(initIp330Scan(ip330, "server", first, last, queuesize) of release 1-7: write 0 for MS)"),
          HasSubstr(
              R"(initIp330Scan("module", "carrier", "site", "type", "range", vector, queuesize))"),
          HasSubstr(R"(initIp330Config(ip330, "server", queuesize))"),
          HasSubstr(R"(initIp330Sweep(ip330, "server", first, last, maxPoints, queuesize))"),
          HasSubstr(R"(initIp330PID("server", ip330, channel, dac, dacChannel, queuesize))")));
}

TEST_F(Ip330ProgramTest, ReportsAnUnknownCarrier) {
  const auto server = start({"adc", "ipac", "IP_a", "--carrier", "ipac=no-such-kind"});
  EXPECT_NE(server->wait(), 0);
  EXPECT_THAT(server->errors(), HasSubstr("no-such-kind"));
}

TEST_F(Ip330ProgramTest, ReportsInvalidArguments) {
  for (const auto& [options, complaint] :
       std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"X"}, "type \"X\": use D"},
           {{"S", "-3to3"}, "range \"-3to3\": use -5to5"},
           {{"D", "0to5", "0", "16"}, "use 0 to 15"},
           {{"--us-per-scan", "1"}, "us per scan"},
           {{"--scan-mode", "7"}, "scan mode 7"},
           {{"--trigger", "in"}, "use Input or Output"},
           {{"--scan", "a,0"}, "last channel"},
           {{"--scan", "a,0,x"}, "\"x\" is not a whole number"},
           {{"--scan", "a,-1,5"}, "first channel -1: use 0 or more"},
           {{"--scan", "a,0,15,-100"}, "averaging time -100: use 0 or more"},
           {{"--sweep", "a,0,1"}, "points is missing"},
           {{"--config", "a,0"}, "use 1 to 16384"},
           {{"--config", "a,1,2"}, "unexpected field \"2\""},
           {{"--pid", "p,0,dac,2"}, "no --dac has the name dac"},
           {{"--dac", "d,ipac,IP_b", "--pid", "p,16,d,2"}, "channel 16: the board"},
           {{"--signal", "0=square:1"},
            "unknown kind of signal \"square\"; use one of dc, sine, wire"},
           {{"--signal", "0=wire:dac.0"}, "a wire needs --wires FILE"},
           {{"--signal", "16=dc:1"}, "--signal: channel 16 is not available: the board"},
           {{"--signal", "0=dc:nan"}, "\"nan\" is not a number"},
           {{"--scan", "a,0,20"}, "the board scans 0 to 15"}}) {
    std::vector<std::string> all{"adc", "ipac", "IP_a"};
    all.insert(all.end(), options.begin(), options.end());
    all.insert(all.end(), {"--carrier", "ipac=model"});
    const auto server = start(all);
    EXPECT_NE(server->wait(), 0) << complaint;
    EXPECT_THAT(server->errors(), HasSubstr(complaint));
  }
}

}  // namespace
}  // namespace mpf::test
