// SPDX-License-Identifier: MIT
// mpf-serial-server on ports of an octal UART: a process on a model carrier, instruments on its
// pseudo-terminals.
#include <fcntl.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mpf/serial_commands.h>
#include <mpf/sync_client.h>

#include "tests/server/programs/serial_server/ask_serial.h"
#include "tests/support/instrument.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class OctalProgramTest : public testing::Test {
 protected:
  std::unique_ptr<Program> start(const std::vector<std::string>& options) const {
    std::vector<std::string> command{MPF_TEST_SERIAL_SERVER, "--backplane", backplane_.name()};
    command.insert(command.end(), options.begin(), options.end());
    return std::make_unique<Program>(command);
  }
  static std::string terminalOf(const Program& program, const std::string& port) {
    const auto line = program.waitForLine(port + " is a model");
    return line.substr(std::min(line.find("/dev/"), line.size()));
  }
  static void connect(Instrument& instrument, const std::string& terminal) {
    instrument.connect(FileDescriptor(checkCall(
        ::open(terminal.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC), "open", terminal)));
  }
  std::string ask(const std::string& server, std::string_view text,
                  std::int32_t timeoutSeconds = 60) const {
    SyncClient client(backplane_, server);
    EXPECT_TRUE(client.connectWait(60s)) << server;
    const auto reply =
        askSerial(client, text, {.timeout = timeoutSeconds, .cmd = serial::cmdWriteRead});
    return reply.status == serial::serialServerStatusOK ? reply.text : "refused";
  }
  // Expects that the program exits with status 2 and this message.
  void expectRefused(const std::vector<std::string>& options, const std::string& complaint) const {
    const auto server = start(options);
    const auto status = server->wait();
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 2) << complaint;
    EXPECT_THAT(server->errors(), HasSubstr(complaint));
  }

  Watchdog watchdog_{"octal program test"};
  TemporaryFolder folder_;
  TestBackplane backplane_;
};

TEST_F(OctalProgramTest, ServesEightPortsOfOneModule) {
  std::vector<std::string> options{"--carrier", "ipac=model", "--octal-uart",
                                   "UART0,ipac,IP_a,8,100"};
  for (int i = 0; i < 8; ++i) {
    const auto port = "UART0[" + std::to_string(i) + "]";
    options.insert(options.end(),
                   {"--octal-port", port + "," + "UART0," + std::to_string(i) + ",38400,N,1,8,N"});
    options.insert(options.end(), {"--server", "a-Serial[" + std::to_string(i) + "]," + port +
                                                   ",1000,20,\\r\\n,1"});
  }
  const auto server = start(options);
  std::array<Instrument, 8> instruments;
  for (std::size_t i = 0; i < instruments.size(); ++i)
    connect(instruments.at(i), terminalOf(*server, "UART0[" + std::to_string(i) + "]"));

  for (int i = 0; i < 8; ++i) {
    const auto number = std::to_string(i);
    EXPECT_EQ(ask("a-Serial[" + number + "]", "ECHO number " + number + "\n"),
              "number " + number + "\r\n");
  }

  const auto status = server->end(SIGTERM);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
}

TEST_F(OctalProgramTest, ServesOnePortLikeATerminal) {
  const auto server =
      start({"dmm", "UART0[3]", "1000", "20", "\\r\\n", "--carrier", "ipac=model", "--octal-uart",
             "UART0,ipac,IP_a,4", "--octal-port", "UART0[3],UART0,3"});
  Instrument instrument;
  connect(instrument, terminalOf(*server, "UART0[3]"));
  EXPECT_THAT(server->waitForLine("serving"),
              HasSubstr("port 3 of UART0 (carrier ipac, site IP_a) (9600 baud, 8N1, no flow "
                        "control) as \"dmm\""));

  EXPECT_EQ(ask("dmm", "*IDN?\n"), "MPF,INSTRUMENT,0,1.0\r\n");

  const auto status = server->end(SIGINT);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

// A busy host may delay the driver. Then the line has not turned round when the answer begins, or
// the chip has no room for the answer: bytes are lost, as on a real line, and the question is sent
// again.
TEST_F(OctalProgramTest, ServesAModelWithRealTiming) {
  const auto server = start({"dmm", "line", "1000", "20", "\\r\\n", "--octal-port",
                             "line,UART0,0,1200", "--octal-uart", "UART0,ipac,IP_b,8", "--carrier",
                             "ipac=model", "--octal-timing", "--octal-model", "485"});
  Instrument instrument;
  connect(instrument, terminalOf(*server, "line"));
  const auto begin = std::chrono::steady_clock::now();

  while (ask("dmm", "*IDN?\n", 2) != "MPF,INSTRUMENT,0,1.0\r\n") continue;

  EXPECT_GE(std::chrono::steady_clock::now() - begin, 28 * 8ms);
}

TEST_F(OctalProgramTest, ReportsInvalidOptions) {
  const std::vector<std::string> uart{"--carrier", "ipac=model", "--octal-uart", "U,ipac,IP_a,8"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), uart.begin(), uart.end());
    return more;
  };
  expectRefused({}, "mpf-serial-server: server is required");
  expectRefused({"dmm"}, "port is required");
  expectRefused({"dmm", "x", "--octal-uart", "U,ipac"}, "--octal-uart: U,ipac: site is missing");
  expectRefused({"dmm", "x", "--octal-uart", "U,ipac,IP_a,many"},
                R"(number of ports "many" is not a whole number)");
  expectRefused(with({"dmm", "x", "--octal-port", "x,V,0"}),
                "--octal-port: x: no --octal-uart has the name V");
  expectRefused(with({"dmm", "x", "--octal-port", "x,U,0", "--octal-port", "x,U,1"}),
                "two ports have that name");
  expectRefused(with({"dmm", "x", "--server", "other,x", "--octal-port", "x,U,0"}),
                "port x: has two servers");
  expectRefused({"--server", "dmm,/dev/null,1000,20,\\q\\q\\q"},
                "end of message \\q\\q\\q: use 1 or 2 bytes");
  expectRefused({"--server", "dmm,/dev/null,1000,99999"}, "queue size 99999: use 1 to 16384");
  expectRefused({"--server", "dmm,/dev/null,0"}, "longest answer 0: use 1 to 1048576 bytes");
  expectRefused({"--server", "dmm,/dev/null,1000,20,\\r,1,more"}, "unexpected field \"more\"");
  expectRefused(with({"dmm", "x", "--octal-port", "x,U,0,9600,none"}),
                "parity \"none\" is not one letter");
  expectRefused(with({"dmm", "x", "--octal-port", "x,U,0", "--server", "other,tcp:host:1", "--baud",
                      "19200"}),
                "--baud is for terminal devices, and no port is one");
}

TEST_F(OctalProgramTest, ReportsAnInvalidModule) {
  const auto startWith = [&](const std::string& uart, const std::string& port) {
    return start(
        {"dmm", "x", "--carrier", "ipac=model", "--octal-uart", uart, "--octal-port", port});
  };
  for (const auto& [uart, port, complaint] : std::vector<std::array<std::string, 3>>{
           {"U,ipac,IP_a,8", "x,U,8", "port 8: the module has ports 0 to 7"},
           {"U,ipac,IP_a,6", "x,U,0", "6 ports: a module has 4 or 8"},
           {"U,ipac,IP_a,8", "x,U,0,57600", "baud 57600: the chip supports"},
           {"U,ipac,IP_a,8,256", "x,U,0", "interrupt vector 256 is not 0 to 255"},
           {"U,other,IP_a,8", "x,U,0", "carrier \"other\" is not defined"}}) {
    const auto server = startWith(uart, port);
    const auto status = server->wait();
    ASSERT_TRUE(WIFEXITED(status)) << complaint;
    // the driver refuses the vector
    EXPECT_EQ(WEXITSTATUS(status), uart == "U,ipac,IP_a,8,256" ? 1 : 2) << complaint;
    EXPECT_THAT(server->errors(), HasSubstr(complaint));
  }
}

// --wait does not wait for a board that this host cannot have, or for wrong parameters to change;
// it waits for a missing board.
TEST_F(OctalProgramTest, WaitsOnlyForBoardsThatMayAppear) {
  const auto startWith = [&](const std::string& carrier) {
    return start({"dmm", "x", "--wait", "--carrier", "ipac=" + carrier, "--octal-uart",
                  "U,ipac,IP_a,8", "--octal-port", "x,U,0"});
  };
  for (const auto& [carrier, complaint] : std::vector<std::array<std::string, 2>>{
           {"&vipc616_01:0x3000,0xa0000000", "no access to a VME crate"},
           {"&vipc616_01:0x3001", "I/O address 0x3001"},
           {"tpci200:0,poll=never", "\"poll=never\""}}) {
    const auto server = startWith(carrier);
    const auto status = server->wait();
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1) << complaint;
    EXPECT_THAT(server->errors(), HasSubstr(complaint));
  }
  const auto server = startWith("tpci200:9");
  EXPECT_THAT(server->waitForLine("waiting for the board"), HasSubstr("this host has no TPCI200"));
  EXPECT_NE(server->waitForLine("waiting for the line"), "");
  EXPECT_EQ(ask("dmm", "*IDN?\n"), "refused");
  EXPECT_EQ(server->end(SIGTERM), 0);
}

TEST_F(OctalProgramTest, LogsThePriorityOfInterrupts) {
  const auto server = start({"dmm", "x", "--real-time", "0", "--carrier", "ipac=model",
                             "--octal-uart", "U,ipac,IP_a,8", "--octal-port", "x,U,0"});
  SyncClient client(backplane_, "dmm");
  EXPECT_TRUE(client.connectWait(60s));

  EXPECT_EQ(server->end(SIGTERM), 0);
  EXPECT_THAT(server->errors(),
              HasSubstr("interrupts are served at ordinary priority (--real-time 0)"));
}

// A missing module delays only the clients of its ports, whose requests get an error status.
TEST_F(OctalProgramTest, AllServersRunWhileOneModuleIsMissing) {
  const auto path = folder_.file("line");
  Instrument instrument(path);
  const auto server =
      start({"dmm", path, "1000", "20", "\\r\\n", "--wait", "--carrier", "ipac=tpci200:9",
             "--octal-uart", "U,ipac,IP_a,8", "--octal-port", "x,U,0", "--server", "other,x"});

  EXPECT_EQ(ask("dmm", "*IDN?\n"), "MPF,INSTRUMENT,0,1.0\r\n");
  EXPECT_EQ(ask("other", "*IDN?\n"), "refused");

  EXPECT_EQ(server->end(SIGTERM), 0);
  const auto said = server->errors();
  EXPECT_THAT(said, HasSubstr("waiting for the line: this host has no TPCI200"));
  EXPECT_THAT(said, HasSubstr("serving port 0 of U (carrier ipac, site IP_a)"));
}

}  // namespace
}  // namespace mpf::test
