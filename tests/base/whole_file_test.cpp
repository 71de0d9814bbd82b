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

TEST(ReadEndOfFile, ReturnsTheLastBytes) {
  const TemporaryFolder folder;
  const auto file = folder.write("file", "0123456789");

  const auto end = readEndOfFile(file, 3);

  EXPECT_EQ(end.text, "789");
  EXPECT_EQ(end.leftOutBytes, 7u);
  EXPECT_EQ(readEndOfFile(file, 11).text, "0123456789");
  EXPECT_EQ(readEndOfFile(file, 11).leftOutBytes, 0u);
  EXPECT_THROW(static_cast<void>(readEndOfFile(folder.file("absent"), 3)), std::system_error);
}

}  // namespace
}  // namespace mpf::test
