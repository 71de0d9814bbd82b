// SPDX-License-Identifier: MIT
// OutputFile: its contents, and its errors.
#include "base/output_file.h"

#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>
#include <system_error>

#include "tests/support/temporary_folder.h"

namespace mpf {
namespace {

std::string textOf(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// The text of the std::system_error that a call throws; empty if it throws none.
template <class Call>
std::string errorOf(Call call) try {
  call();
  return {};
} catch (const std::system_error& error) {
  return error.what();
}

TEST(OutputFile, ReplacesTheOldContentsAtTheFirstWrite) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("x", "old and longer");

  OutputFile file(path);
  EXPECT_EQ(textOf(path), "old and longer");
  file.write("new ");
  file.write("text");
  file.close();

  EXPECT_EQ(textOf(path), "new text");
}

TEST(OutputFile, IsEmptyAfterCloseWithoutAWrite) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("x", "old");

  OutputFile(path).close();

  EXPECT_EQ(textOf(path), "");
}

TEST(OutputFile, ThrowsAtConstructionIfItCannotBeWritten) {
  const test::TemporaryFolder folder;

  EXPECT_EQ(errorOf([] { OutputFile("/dev/full"); }), "write /dev/full: No space left on device");
  const auto missing = folder.file("none/x");
  EXPECT_EQ(errorOf([&] { OutputFile{missing}; }),
            "open " + missing + ": No such file or directory");
}

TEST(ReplaceFile, ReplacesTheWholeFile) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("x", "old and longer");

  replaceFile(path, "new", 0600);

  EXPECT_EQ(textOf(path), "new");
  EXPECT_FALSE(std::filesystem::exists(path + ".new"));
}

TEST(ReplaceFile, LeavesNoPartAfterAFailure) {
  const test::TemporaryFolder folder;
  const auto path = folder.file("x");
  std::filesystem::create_directory(path);

  EXPECT_EQ(errorOf([&] { replaceFile(path, "new", 0600); }),
            "rename " + path + ": Is a directory");

  EXPECT_FALSE(std::filesystem::exists(path + ".new"));
}

}  // namespace
}  // namespace mpf
