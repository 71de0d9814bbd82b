// SPDX-License-Identifier: MIT
#include "crate/startup/shell/startup_file.h"

#include <gtest/gtest.h>
#include <stdexcept>
#include <string>

#include "crate/startup/shell/startup_shell.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using startup::StartupFile;

TEST(StartupFileTest, LinesEndWithLfOrCrLf) {
  const auto file = StartupFile::ofContent(
      "\xEF\xBB\xBF"
      "a\r\nb\n\nc");

  EXPECT_EQ(file.lines, (std::vector<std::string_view>{"a", "b", "", "c"}));
}

TEST(StartupFileTest, RefusesWhatIsNoText) {
  EXPECT_THROW(StartupFile::ofContent(std::string("a\0b", 3)), std::runtime_error);
  EXPECT_THROW(
      StartupFile::ofContent(std::string(startup::StartupShell::Limits::kFileBytes + 1, 'a')),
      std::runtime_error);
}

TEST(StartupFileTest, RefusesAFolderADeviceAndAnAbsentFile) {
  for (const auto* path : {"/", "/dev/zero", "/does-not-exist"})
    EXPECT_THROW(StartupFile::read(path), std::runtime_error) << path;
}

TEST(StartupFileTest, NamesOfFilesThatEachSiteHas) {
  EXPECT_TRUE(startup::isFileOfSite("../x/cdCommands.68K"));
  EXPECT_TRUE(startup::isFileOfSite("envPaths"));
  EXPECT_FALSE(startup::isFileOfSite("st_mpfserver.cmd"));
}

}  // namespace
}  // namespace mpf::test
