// SPDX-License-Identifier: MIT
// Reads files that are empty, longer than a read, or absent.
#include "base/whole_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <system_error>

#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

TEST(ReadWholeFile, ReturnsAllBytes) {
  const TemporaryFolder folder;
  std::string text(10'000, 'x');
  text[5000] = '\0';

  EXPECT_EQ(readWholeFile(folder.write("long", text)), text);
  EXPECT_EQ(readWholeFile(folder.write("empty", "")), "");
}

TEST(ReadWholeFile, NamesTheFileThatCannotBeRead) {
  const TemporaryFolder folder;
  const auto absent = (folder.path() / "absent").string();

  try {
    static_cast<void>(readWholeFile(absent));
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), ENOENT);
    EXPECT_THAT(error.what(), testing::HasSubstr(absent));
  }
  EXPECT_THROW(static_cast<void>(readWholeFile(folder.path().string())), std::system_error)
      << "a folder";
}

}  // namespace
}  // namespace mpf::test
