// SPDX-License-Identifier: MIT
#include "server/programs/server_arguments.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using testing::HasSubstr;

ServerArguments parse(const std::string& line) {
  ServerArguments arguments;
  CLI::App app;
  arguments.addTo(app);
  app.parse(line);
  return arguments;
}

std::string complaintOf(const std::string& line) {
  try {
    parse(line);
    return "none";
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
}

TEST(ServerArguments, HaveTheDefaultsOfServerOptions) {
  const auto arguments = parse("");

  EXPECT_EQ(arguments.messages.location, Backplane::defaultLocation());
  EXPECT_EQ(arguments.messages.waitMode, WaitMode::adaptive);
  EXPECT_EQ(arguments.messages.rights.mode, ServerOptions().rights.mode);
  EXPECT_EQ(arguments.messages.rights.group, ServerOptions().rights.group);
  EXPECT_EQ(arguments.logLevel, "info");
}

TEST(ServerArguments, AreReadFromTheCommandLine) {
  const auto* group = ::getgrgid(::getegid());
  ASSERT_NE(group, nullptr);

  const auto arguments = parse(
      std::string(
          "--backplane b --location 7 --wait-mode block --mode 0660 --log-level debug --group ") +
      group->gr_name);

  EXPECT_EQ(arguments.backplane, "b");
  EXPECT_EQ(arguments.messages.location, 7);
  EXPECT_EQ(arguments.messages.waitMode, WaitMode::block);
  EXPECT_EQ(arguments.messages.rights.mode, 0660U);
  EXPECT_EQ(arguments.messages.rights.group, ::getegid());
  EXPECT_EQ(arguments.logLevel, "debug");
}

TEST(ServerArguments, EachWaitModeHasItsName) {
  EXPECT_EQ(parse("--wait-mode spin").messages.waitMode, WaitMode::spin);
  EXPECT_EQ(parse("--wait-mode adaptive").messages.waitMode, WaitMode::adaptive);
  EXPECT_EQ(parse("--wait-mode block").messages.waitMode, WaitMode::block);
}

TEST(ServerArguments, AModeIsOctalLetsTheOwnerInAndExecutesNothing) {
  EXPECT_EQ(parse("--mode 666").messages.rights.mode, 0666U);
  for (const auto* const mode :
       {"0888", "0660x", "rw", "0060", "0400", "0770", "2660", "99999999999"}) {
    EXPECT_THAT(complaintOf(std::string("--mode ") + mode),
                HasSubstr(std::string(mode) + ": use an octal number between 0600 and 0666"));
  }
}

TEST(ServerArguments, AGroupMustExistAndNeedsAMode) {
  EXPECT_THAT(complaintOf("--mode 0660 --group no-such-group"),
              HasSubstr("no-such-group: there is no group of this name"));
  EXPECT_THAT(complaintOf("--group root"), HasSubstr("requires --mode"));
}

}  // namespace
}  // namespace mpf::test
