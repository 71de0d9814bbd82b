// SPDX-License-Identifier: MIT
// The program mpf-ioc, with commands on its standard input.
#include <sys/wait.h>

#include <cstdlib>
#include <gmock/gmock.h>

#include "tests/support/command.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

// The server for Channel Access listens on loopback only.
class IocProgram : public testing::Test {
 protected:
  IocProgram() {
    ::setenv("EPICS_CAS_INTF_ADDR_LIST", "127.0.0.1", 1);
    ::setenv("EPICS_CAS_BEACON_ADDR_LIST", "127.0.0.1", 1);
    ::setenv("EPICS_CAS_AUTO_BEACON_ADDR_LIST", "NO", 1);
  }
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

}  // namespace
}  // namespace mpf::test
