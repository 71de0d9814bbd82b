// SPDX-License-Identifier: MIT
// The program mpf-ioc, with commands on its standard input or in a startup file.
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <sstream>

#include <mpf/message_server.h>

#include "tests/support/command.h"
#include "tests/support/program.h"
#include "tests/support/router_pair.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// The servers for Channel Access and pvAccess listen on loopback only.
class IocProgram : public testing::Test {
 protected:
  IocProgram() {
    ::setenv("EPICS_CAS_INTF_ADDR_LIST", "127.0.0.1", 1);
    ::setenv("EPICS_CAS_BEACON_ADDR_LIST", "127.0.0.1", 1);
    ::setenv("EPICS_CAS_AUTO_BEACON_ADDR_LIST", "NO", 1);
    ::setenv("EPICS_PVAS_INTF_ADDR_LIST", "127.0.0.1", 1);
    ::setenv("EPICS_PVAS_BEACON_ADDR_LIST", "127.0.0.1", 1);
    ::setenv("EPICS_PVAS_AUTO_BEACON_ADDR_LIST", "NO", 1);
    ::setenv("EPICS_PVAS_SERVER_PORT", "0", 1);
    ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1);
  }
  TestBackplane backplane_;
  const Watchdog watchdog_{"IOC program"};
};

TEST_F(IocProgram, LoadsADatabaseAndListsItsRecords) {
  const TemporaryFolder folder;
  const auto database =
      folder.write("a.db", "record(ai, \"$(P)v\") { field(DTYP, \"ip330Scan\") }");

  const auto result =
      runCommand(std::string("echo dbl | ") + MPF_TEST_IOC + " -d " + database + " -m P=lab: 2>&1");

  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("lab:v"));
}

TEST_F(IocProgram, ChecksItsDatabasesWithoutRunning) {
  const TemporaryFolder folder;
  const auto good = folder.write("a.db", "record(ai, \"v\") {}");
  const auto wrong = folder.write("b.db", "record(nothing, \"v\") {}");
  const auto check = std::string(MPF_TEST_IOC) + " -S --check -d ";

  EXPECT_EQ(runCommand(check + good + " 2>&1").status, 0);
  const auto result = runCommand(check + wrong + " 2>&1");
  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("cannot load the database " + wrong));
}

TEST_F(IocProgram, ReportsADatabaseThatItCannotLoad) {
  const TemporaryFolder folder;
  const auto database = folder.write("a.db", "record(nothing, \"v\") {}");

  const auto result =
      runCommand(std::string(MPF_TEST_IOC) + " -S -d " + database + " </dev/null 2>&1");

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("mpf-ioc: cannot load the database " + database));
}

TEST_F(IocProgram, RunsAStartupFile) {
  const TemporaryFolder folder;
  static_cast<void>(folder.write("a.db", "record(ao, \"v\") { field(VAL, \"4\") }"));
  const auto startup =
      folder.write("st.cmd", "dbLoadRecords(\"" + folder.file("a.db") + "\")\niocInit\ndbgf v\n");

  const auto result = runCommand(std::string(MPF_TEST_IOC) + " " + startup + " </dev/null 2>&1");

  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("DBF_DOUBLE:"));
}

TEST_F(IocProgram, RunsReportsWhoseOutputMayBeRedirected) {
  const TemporaryFolder folder;
  const MessageServer server(backplane_, "lamp");
  const auto startup =
      folder.write("st.cmd", fmt::format("mpf ls > {}\nmsr lamp\nmrr\n", folder.file("ls.txt")));

  const auto result = runCommand(std::string(MPF_TEST_IOC) + " " + startup + " </dev/null 2>&1");

  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("clientRouterList"));
  std::stringstream listed;
  listed << std::ifstream(folder.file("ls.txt")).rdbuf();
  EXPECT_THAT(listed.str(), HasSubstr("lamp"));
}

TEST_F(IocProgram, ADatabaseMayStandBeforeTheStartupFile) {
  const TemporaryFolder folder;
  const auto database = folder.write("a.db", "record(ao, \"v\") {}");
  const auto startup = folder.write("st.cmd", "iocInit\ndbl\n");

  const auto result =
      runCommand(fmt::format("{} -d {} {} </dev/null 2>&1", MPF_TEST_IOC, database, startup));

  EXPECT_EQ(result.status, 0) << result.output;
}

TEST_F(IocProgram, ASignalEndsAServiceWhoseStartupDoesNotEnd) {
  const TemporaryFolder folder;
  const auto startup = folder.write(
      "st.cmd", fmt::format("mpf ls > {}\nepicsThreadSleep 100000\n", folder.file("begun")));
  Program ioc({MPF_TEST_IOC, "-S", startup});
  while (::access(folder.file("begun").c_str(), F_OK) != 0) continue;

  ioc.signal(SIGTERM);

  EXPECT_THAT(ioc.waitForLine("mpf-ioc: "), HasSubstr("before its startup was complete"));
  EXPECT_EQ(WEXITSTATUS(ioc.wait()), 1);
}

class IocRouter : public IocProgram {
 protected:
  // Starts an IOC whose startup file connects to another host, and ends it when one of its records
  // has sent a request to a server there.
  int runAndEnd(int signal);
};

int IocRouter::runAndEnd(int signal) {
  const TestBackplane far;
  MessageServer server(far, "lamp");
  RouterProcess router(
      {"--backplane", far.name(), "--serve", "1=0", "--listen", "127.0.0.1:0", "--plain"});
  const auto port = router.listening().substr(router.listening().rfind(':') + 1);
  const TemporaryFolder folder;
  static_cast<void>(
      folder.write("a.db",
                   "record(longin, \"v\") { field(DTYP, \"MPF\") field(INP, \"@lamp:1 address=7\")"
                   " field(SCAN, \".1 second\") }"));
  const auto startup = folder.write(
      "st.cmd",
      fmt::format("routerInit\nlocalMessageRouterStart(0)\n"
                  "tcpMessageRouterClientStart(1, {0}, \"127.0.0.1\", 1500, 40)\n"
                  "tcpMessageRouterClientStart(1, {0}, \"127.0.0.1\", 1500, 40)\n"
                  "dbLoadRecords(\"{1}\")\niocInit\ndbl > {2}\n",
                  port.substr(0, port.find('\n')), folder.file("a.db"), folder.file("started")));
  Program ioc({MPF_TEST_IOC, "-S", startup});

  Message request;
  while (!(request = server.receive())) server.waitForMessage();
  const auto* question = request.tryAs<Int32>();
  EXPECT_TRUE(question != nullptr && question->address == 7);
  while (::access(folder.file("started").c_str(), F_OK) != 0) continue;
  return ioc.end(signal);
}

TEST_F(IocRouter, EndsWithTheIoc) {
  EXPECT_EQ(runAndEnd(SIGTERM), 0);

  EXPECT_THAT(backplane_.segmentNames(), IsEmpty());
}

// A killed IOC cannot end its router; the kernel does.
TEST_F(IocRouter, EndsWithAnIocThatIsKilled) {
  EXPECT_EQ(runAndEnd(SIGKILL), SIGKILL);

  while (!backplane_.segmentNames().empty()) static_cast<void>(backplane_.removeDead());
}

// examples/epics_two_hosts, both sides on this host.
TEST_F(IocProgram, RecordsOfTheExampleReachTheServersOfTheOtherHost) {
  const TestBackplane far;
  const FreePort port;
  const auto& address = port.address();
  ::setenv("MPF_BACKPLANE", far.name().c_str(), 1);
  Program servers({MPF_TEST_TWO_HOSTS "/server", MPF_TEST_BUILD, address});
  ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1);

  const auto client = fmt::format(
      "printf 'epicsThreadSleep 3\\ndbgf rst:int32\\ndbgf rst:text\\ndbgf rst:serial7\\n' "
      "| " MPF_TEST_TWO_HOSTS "/client " MPF_TEST_BUILD " 127.0.0.1 {} 2>&1",
      address.substr(address.find(':') + 1));
  const auto showsAllServers = testing::Matches(testing::AllOf(
      testing::ContainsRegex("DBF_LONG: +[1-9]"), HasSubstr("\"value "), HasSubstr("\"line 7: ")));
  // The routers may need more than the 3 seconds. The output of such a trial is printed, so that
  // the log of a test that does not end shows why.
  for (std::string printed; !showsAllServers(printed = runCommand(client).output);) {
    ASSERT_FALSE(servers.hasEnded()) << servers.errors();
    fmt::print("again, because the IOC printed:\n{}\n", printed);
    std::fflush(stdout);
  }

  servers.end(SIGTERM);
}

}  // namespace
}  // namespace mpf::test
