// SPDX-License-Identifier: MIT
// Programs that drive modules, as processes: how they start, what they log, how they stop, and
// wires from one to the other.
#include <array>
#include <cstdio>

#include <mpf/digital_io_commands.h>

#include "tests/server/programs/hardware/hardware_fixture.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// The output of a program with --help.
std::string helpOf(const std::string& program) {
  std::string help;
  auto* const output = ::popen((program + " --help").c_str(), "r");
  std::array<char, 4096> bytes{};
  for (std::size_t length = 0; (length = std::fread(bytes.data(), 1, bytes.size(), output)) > 0;)
    help.append(bytes.data(), length);
  EXPECT_EQ(::pclose(output), 0);
  return help;
}

class HardwareProgramTest : public testing::Test {
 protected:
  using OptionFields = std::vector<std::string>;
  [[nodiscard]] std::unique_ptr<Program> start(const std::string& program,
                                               OptionFields words) const {
    words.insert(words.begin(), program);
    words.insert(words.end(), {"--backplane", backplane_.name()});
    return std::make_unique<Program>(words);
  }
  [[nodiscard]] std::unique_ptr<Program> startDac(const OptionFields& more) const {
    OptionFields words{"dac", "ipac", "IP_a", "20"};
    words.insert(words.end(), more.begin(), more.end());
    return start(MPF_TEST_DAC128V_SERVER, words);
  }
  [[nodiscard]] std::unique_ptr<Program> startDio(const OptionFields& more) const {
    OptionFields words{"dio", "ipac", "IP_b", "20", "1000", "116", "0xff", "0xf00ff", "0", "5"};
    words.insert(words.end(), more.begin(), more.end());
    return start(MPF_TEST_DIGITAL_IO_SERVER, words);
  }
  void expectEndsWell(Program& program, int signal = SIGTERM) const {
    const auto status = program.end(signal);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  }
  void expectFails(Program& program, const std::string& because) const {
    EXPECT_THAT(program.errors(), HasSubstr(because));
    const auto status = program.wait();
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) != 0) << status;
  }

  Watchdog watchdog_{"hardware program test"};
  TemporaryFolder folder_;
  TestBackplane backplane_;
};

TEST_F(HardwareProgramTest, ServesAndStopsAndLeavesNoFiles) {
  for (const auto signal : {SIGTERM, SIGINT}) {
    const auto dac = startDac({"--carrier", "ipac=model"});
    const auto dio = startDio({"--carrier", "ipac=model"});
    {
      EXPECT_EQ(HardwareAsker(backplane_, "dac").ask({.address = 1, .value = 5}).status, 0);
      EXPECT_EQ(HardwareAsker(backplane_, "dioOut")
                    .ask({.cmd = digital::cmdClearBits, .address = 5})
                    .status,
                0);
      HardwareAsker in(backplane_, "dioIn");
      EXPECT_EQ(in.ask({.cmd = digital::cmdStartMonitor}).value, 0xfffffa);
      expectEndsWell(*dio, signal);
    }
    expectEndsWell(*dac, signal);
    EXPECT_THAT(backplane_.segmentNames(), IsEmpty());
    EXPECT_THAT(dac->errors(),
                HasSubstr("serving the Systran DAC128V at carrier ipac, site IP_a as \"dac\""));
    const auto said = dio->errors();
    EXPECT_THAT(said, HasSubstr("IP-Unidig-I at carrier ipac, site IP_b: polled every 1000 ms, "
                                "interrupts with vector 116"));
    EXPECT_THAT(said, HasSubstr("maxclients 5 is ignored: any number of clients may monitor"));
    EXPECT_THAT(said, HasSubstr("serving \"dioIn\" and \"dioOut\""));
  }
}

TEST_F(HardwareProgramTest, AreConnectedByAFileOfWires) {
  const auto wires = folder_.file("wires");
  const auto dac =
      startDac({"--carrier", "ipac=model", "--wires", wires, "--ranges", "0to10,-10to10"});
  const auto dio = startDio(
      {"--carrier", "ipac=model", "--wires", wires, "--input", "0=dac.0", "--input", "3=dio.20"});
  HardwareAsker volts(backplane_, "dac");
  HardwareAsker out(backplane_, "dioOut");
  HardwareAsker in(backplane_, "dioIn");
  ASSERT_EQ(volts.ask({.address = 0, .value = 0}).status, 0);
  ASSERT_EQ(in.ask({.cmd = digital::cmdStartMonitor, .address = 9}).status, 0);

  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(volts.ask({.address = 0, .value = 2048}).status, 0);
    for (auto inputs = 0; (inputs & 1) == 0;) inputs = in.next().value;
    EXPECT_EQ(volts.ask({.address = 0, .value = 400}).status, 0);
    for (auto inputs = 1; (inputs & 1) != 0;) inputs = in.next().value;
    EXPECT_EQ(out.ask({.cmd = digital::cmdClearBits, .address = 1 << 20}).status, 0);
    for (auto inputs = 8; (inputs & 8) != 0;) inputs = in.next().value;
    EXPECT_EQ(out.ask({.cmd = digital::cmdSetBits, .address = 1 << 20}).status, 0);
    for (auto inputs = 0; (inputs & 8) == 0;) inputs = in.next().value;
  }
  expectEndsWell(*dac);
  expectEndsWell(*dio);
}

TEST_F(HardwareProgramTest, FollowsWires) {
  const auto wires = folder_.file("wires");
  const auto dac = startDac({"--carrier", "ipac=model", "--wires", wires});
  const auto door =
      start(MPF_TEST_IP440_SERVER, {"door", "ipac", "IP_c", "--carrier", "ipac=model", "--inputs",
                                    "0x80000000", "--wires", wires, "--input", "4=dac.1"});
  HardwareAsker volts(backplane_, "dac");
  HardwareAsker in(backplane_, "door");
  EXPECT_EQ(volts.ask({.address = 1, .value = 0}).status, 0);
  EXPECT_EQ(in.ask({.cmd = digital::cmdReadBits, .address = -1}).value, INT32_MIN);
  EXPECT_EQ(volts.ask({.address = 1, .value = 4095}).status, 0);
  EXPECT_EQ(in.ask({.cmd = digital::cmdReadBits, .address = -1}).value, INT32_MIN + 0x10);
  expectEndsWell(*door);
  expectEndsWell(*dac);
  EXPECT_THAT(door->errors(),
              HasSubstr("serving the Acromag IP440 at carrier ipac, site IP_c as \"door\""));
}

TEST_F(HardwareProgramTest, ReportsInvalidArguments) {
  const auto notAFile = folder_.write("letter", "a letter");
  for (const auto& [words, because] : std::vector<std::pair<OptionFields, std::string>>{
           {{"dac", "ipac"}, "site is required"},
           {{"dac", "ipac", "IP_a"}, "carrier \"ipac\" is not defined"},
           {{"dac", "ipac", "IP_x", "--carrier", "ipac=model"}, "no site \"IP_x\""},
           {{"dac", "ipac", "IP_a", "0", "--carrier", "ipac=model"},
            "queuesize: 0 is out of range"},
           {{"--carrier", "ipac=model", "dac", "ipac", "IP_a", "--ranges", "3to4"},
            "\"3to4\" is not an output range"},
           {{"dac", "ipac", "IP_a", "--carrier", "ipac=model", "--wires", notAFile},
            "letter is not a file of model wires"}}) {
    expectFails(*start(MPF_TEST_DAC128V_SERVER, words), because);
  }
  for (const auto& [words, because] : std::vector<std::pair<OptionFields, std::string>>{
           {{"20", "0", "256"}, "intvec: 256 is out of range"},
           {{"20", "0", "1", "0x1ffffffff"}, "risingmask"},
           {{"--kind", "IP-Unidig-T"}, "unknown kind \"IP-Unidig-T\"; the kinds are IP-Unidig-E"},
           {{"--input", "32=dac.0"}, "\"32=dac.0\" does not have the form BIT=WIRE"},
           {{"--input", "3=dac.0"}, "--input requires --wires"}}) {
    auto all = words;
    all.insert(all.begin(), {"dio", "ipac", "IP_b"});
    all.insert(all.end(), {"--carrier", "ipac=model"});
    expectFails(*start(MPF_TEST_DIGITAL_IO_SERVER, all), because);
  }
  EXPECT_THAT(backplane_.segmentNames(), IsEmpty());
}

TEST_F(HardwareProgramTest, ReportsThatAModelHasNoInterrupts) {
  const auto dio = startDio({"--carrier", "ipac=model", "--kind", "IP-Unidig"});
  EXPECT_EQ(HardwareAsker(backplane_, "dioIn").ask({.cmd = digital::cmdStartMonitor}).value,
            0xffffff);
  expectEndsWell(*dio);
  EXPECT_THAT(dio->errors(),
              HasSubstr("IP-Unidig has no interrupts: changes are found by polling"));
}

TEST_F(HardwareProgramTest, ShowTheirOldCommandsInTheirHelp) {
  EXPECT_THAT(helpOf(MPF_TEST_DAC128V_SERVER),
              HasSubstr(R"(initDAC128V("module", "carrier", "site", queuesize))"));
  const auto serial = helpOf(MPF_TEST_SERIAL_SERVER);
  EXPECT_THAT(
      serial,
      HasSubstr(R"(initSerialServer("server", "port", bufsize, queuesize, "eomstr", circular))"));
  EXPECT_THAT(serial, HasSubstr(R"(initOctalUART("module", "carrier", "site", nports, intVec))"));
  EXPECT_THAT(
      serial,
      HasSubstr(
          R"(initOctalUARTPort("port", "module", n, baud, "parity", stopbits, bits, "flow"))"));
  EXPECT_THAT(helpOf(MPF_TEST_DIGITAL_IO_SERVER),
              HasSubstr(R"(initIpUnidig("module", "carrier", "site", queuesize, mspoll, intvec,)"));
}

}  // namespace
}  // namespace mpf::test
