// SPDX-License-Identifier: MIT
// scripts/check-databases: databases of sites, with servers over models. MPF_CORPUS is the folder
// of the sites' files; without it the test looks beside the source tree.
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <gmock/gmock.h>
#include <iostream>

#include "tests/support/command.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

EndedCommand checkDatabases(const std::string& folder) {
  const auto programs = std::filesystem::path(MPF_TEST_IOC).parent_path().string();
  return runCommand(MPF_TEST_CHECK_DATABASES " --programs " + programs + " " + folder + " 2>&1");
}

TEST(CheckDatabases, CountsRecordsThatConnectAndThoseOfOtherSoftware) {
  const TemporaryFolder folder;
  static_cast<void>(folder.write("a.db", R"(
    record(ai, "$(P)v") { field(DTYP, "ip330Scan") field(INP, "#C1 S0 @$(IPSLOT)-Ip330Scan") }
    record(motor, "$(P)m") { field(DTYP, "OMS VME58") field(OUT, "#C0 S0 @") } # in no IOC of ours
    record(calc, "$(P)c") { field(DESC, "a } in text") })"));

  const auto result = checkDatabases(folder.path());

  EXPECT_EQ(WEXITSTATUS(result.status), 0);
  EXPECT_THAT(result.output,
              HasSubstr("3 records, 1 skipped, 2 loaded; of MPF's DTYPs 1, 1 connected\n"
                        "skipped: 1 motor (of motor)"));
}

TEST(CheckDatabases, FailsWhenARecordDoesNotLoad) {
  const TemporaryFolder folder;
  static_cast<void>(folder.write("a.db", R"(record(ai, "v") { field(DTYP, "No such support") })"));

  const auto result = checkDatabases(folder.path());

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("No such support"));
}

TEST(CheckDatabases, FailsWhenALinkIsInvalid) {
  for (const std::string gain : {"9", "1x"}) {
    const TemporaryFolder folder;
    static_cast<void>(folder.write(
        "a.db", "record(ai, \"v\") { field(DTYP, \"ip330Scan\") field(INP, \"#C0 S0 @adc," + gain +
                    "\") }"));

    const auto result = checkDatabases(folder.path());

    EXPECT_EQ(WEXITSTATUS(result.status), 1);
    EXPECT_THAT(result.output, HasSubstr("v: INP: gain \"" + gain + "\": use 0, 1, 2 or 3"));
  }
}

// As the original, which read the gain with sscanf().
TEST(CheckDatabases, AcceptsBlanksAroundAGain) {
  const TemporaryFolder folder;
  static_cast<void>(folder.write(
      "a.db", R"(record(ai, "v") { field(DTYP, "ip330Scan") field(INP, "#C0 S0 @adc, 2 ") })"));

  const auto result = checkDatabases(folder.path());

  EXPECT_EQ(WEXITSTATUS(result.status), 0) << result.output;
}

TEST(CheckDatabases, DatabasesOfSitesConnect) {
  const char* folder = std::getenv("MPF_CORPUS");
  const auto databases = std::filesystem::path(folder != nullptr ? folder : MPF_TEST_CORPUS) / "db";
  if (!std::filesystem::exists(databases)) GTEST_SKIP() << "no databases in " << databases;

  const auto result = checkDatabases(databases);

  EXPECT_EQ(WEXITSTATUS(result.status), 0) << result.output;
  std::cout << result.output;
}

}  // namespace
}  // namespace mpf::test
