// SPDX-License-Identifier: MIT
// mpf-gpib-server as a process: a meter on the model of an IP-488, its clients, `mpf gpib-sniff`.
#include <gmock/gmock.h>

#include "tests/server/programs/gpib_server/gpib_asker.h"
#include "tests/support/program.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace gpib;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::IsEmpty;

class GpibProgramTest : public testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<Program> start(const std::vector<std::string>& options = {}) const {
    std::vector<std::string> command{MPF_TEST_GPIB_SERVER,
                                     "GPIB0",
                                     "a-ip488",
                                     "100",
                                     "30",
                                     "--backplane",
                                     backplane_.name(),
                                     "--ti9914",
                                     "a-ip488,ipac,IP_a,105",
                                     "--carrier",
                                     "ipac=model"};
    command.insert(command.end(), options.begin(), options.end());
    return std::make_unique<Program>(command);
  }

  Watchdog watchdog_{"GPIB program test"};
  TestBackplane backplane_;
};

TEST_F(GpibProgramTest, ServesTheInstrumentsOfItsBusUntilSigterm) {
  const auto server = start();
  {
    GpibAsker asker(backplane_, "GPIB0");
    const Char8Array fields{.timeout = 60, .cmd = cmdWriteRead, .address = 22};

    EXPECT_EQ(asker.ask(fields, "ID?\n"),
              (GpibAnswer{gpibStatusOK, gpibReadEndedByEnd, "HP3458A\r\n"}));
    EXPECT_EQ(asker.ask({.timeout = 60, .cmd = cmdWrite, .address = 5}, "x").status,
              gpibStatusNoListener);
    EXPECT_EQ(server->end(SIGTERM), 0);
  }
  EXPECT_THAT(backplane_.segmentNames(), IsEmpty());
}

TEST_F(GpibProgramTest, AServiceRequestReachesSubscribers) {
  const auto server = start({"--poll-timeout", "10min"});
  GpibAsker asker(backplane_, "GPIB0");
  ASSERT_EQ(asker.ask({.timeout = 60, .cmd = cmdSubscribe, .address = 22}).status, gpibStatusOK);

  ASSERT_EQ(asker.ask({.timeout = 60, .cmd = cmdWrite, .address = 22}, "RQS 4;SRQ\n").status,
            gpibStatusOK);

  const auto notice = asker.receive();
  EXPECT_EQ(notice.address, 22);
  EXPECT_EQ(notice.value & kGpibRequestsService, kGpibRequestsService);
}

// The readings and the commands are those of the listing in the manual, "gpibSniff".
TEST_F(GpibProgramTest, SniffingShowsTheListingOfTheManual) {
  const auto server = start();
  GpibAsker asker(backplane_, "GPIB0");
  SyncClient listener(backplane_, "GPIB0.sniff");
  ASSERT_TRUE(listener.call(Int32Message({.cmd = serial::cmdSniffStart}), 10min));
  const Char8Array fields{.timeout = 60, .cmd = cmdRead, .address = 22};
  EXPECT_EQ(asker.ask(fields).text, "-8.874270409E-01\r\n");
  EXPECT_EQ(asker.ask(fields).text, "-9.341735006E-01\r\n");

  ASSERT_TRUE(listener.call(Int32Message({.cmd = serial::cmdSniffStop}), 10min));

  std::string shown;
  while (auto message = listener.receive(0s)) {
    const auto reply = Char8ArrayMessage::tryFrom(std::move(message));
    ASSERT_TRUE(reply);
    const auto records = tryReadRecords(*reply);
    ASSERT_TRUE(records);
    for (const auto& record : *records) {
      if (record.has(SniffRecord::kAttention)) shown += '^';
      shown += static_cast<char>(record.value);
      if (record.has(SniffRecord::kEnd)) shown += '!';
    }
  }
  EXPECT_EQ(shown, "^_^?^V-8.874270409E-01\r\n!^_^?^_^?^V-9.341735006E-01\r\n!^_^?");
}

TEST_F(GpibProgramTest, AMissingControllerEndsItWithTheReason) {
  const std::string missing = "/nowhere/tty";
  for (const auto& [module, exit] :
       {std::pair(std::string("unknown"), 2), std::pair("prologix:" + missing, 1)}) {
    Program server({MPF_TEST_GPIB_SERVER, "GPIB0", module, "--backplane", backplane_.name()});

    const int status = server.wait();

    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == exit) << module << ": " << status;
    EXPECT_THAT(server.errors(), HasSubstr(module == "unknown" ? module : missing));
  }
}

TEST_F(GpibProgramTest, WithWaitItWaitsForTheControllerUntilSigterm) {
  Program server({MPF_TEST_GPIB_SERVER, "GPIB0", "prologix:/nowhere/tty", "--wait", "--backplane",
                  backplane_.name()});
  EXPECT_THAT(server.waitForLine("waiting for the controller"), HasSubstr("/nowhere/tty"));

  EXPECT_EQ(server.end(SIGTERM), 0);
}

}  // namespace
}  // namespace mpf::test
