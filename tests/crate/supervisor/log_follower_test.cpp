// SPDX-License-Identifier: MIT
// LogFollower: new lines with the names of their processes, storms, and logs that are too long.
#include "crate/supervisor/log_follower.h"

#include <poll.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <system_error>

#include "base/whole_file.h"
#include "tests/support/no_descriptors.h"
#include "tests/support/temporary_folder.h"

namespace mpf::crate::test {
namespace {

using testing::HasSubstr;

TEST(LineFolder, CountsLinesThatRepeat) {
  LineFolder folder;
  std::string text;
  for (int i = 0; i < 10; ++i) text += folder.fold("12:00:0" + std::to_string(i) + " full");
  text += folder.fold("empty");

  EXPECT_EQ(text,
            "12:00:00 full\n12:00:01 full\n12:00:02 full\n"
            "(repeated 7 times)\nempty\n");
  EXPECT_EQ(folder.finish(), "");
}

TEST(LineFolder, PrintsLinesThatAreNotLongerThanTheirCount) {
  LineFolder folder;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(folder.fold("tick"), "tick\n");

  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(folder.fold("tick"), "");
    EXPECT_EQ(folder.finish(), "tick\n") << "once a second";
  }
  const std::string line(100, 'a');
  for (int i = 0; i < 4; ++i) static_cast<void>(folder.fold(line));
  EXPECT_EQ(folder.finish(), "(repeated once more)\n");
}

class LogFollowerTest : public testing::Test {
 protected:
  static void append(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::app) << text;
  }
  mpf::test::TemporaryFolder folder_;
  std::string path_ = folder_.file("dac.log");
};

TEST_F(LogFollowerTest, ReturnsWholeLinesFromItsBeginning) {
  append(path_, "before\n");
  LogFollower follower(false, 1u << 20);
  follower.add("dac", path_);

  append(path_, "one\ntw");
  EXPECT_EQ(follower.takeLines(), "dac | one\n");
  append(path_, "o\n\x1b[2J\n");
  EXPECT_EQ(follower.takeLines(), "dac | two\ndac | \\x1b[2J\n");
  EXPECT_EQ(follower.takeLines(), "");
}

TEST_F(LogFollowerTest, ANoteIsALineOfTheFileOnly) {
  append(path_, "before\n");
  LogFollower follower(false, 1u << 20);
  follower.add("dac", path_);

  follower.note("dac", "started, pid 7");
  follower.note("other", "of a log that is not followed");
  append(path_, "-- a line of the process\n");

  EXPECT_EQ(follower.takeLines(), "dac | -- a line of the process\n");
  EXPECT_THAT(readWholeFile(path_),
              testing::MatchesRegex("before\n-- [0-9]{4}-[0-9]{2}-[0-9]{2} [0-9:]{8} started, pid "
                                    "7\n-- a line of the process\n"));
}

TEST_F(LogFollowerTest, ANoteEndsTheLastLineOfAProcess) {
  LogFollower follower(false, 1u << 20);
  follower.add("dac", path_);
  append(path_, "one\nlast wor");
  EXPECT_EQ(follower.takeLines(), "dac | one\n");
  append(path_, "ds");

  follower.note("dac", "SIGSEGV; restart 1");
  append(path_, "of the next\n");

  EXPECT_EQ(follower.takeLines(), "dac | last words\ndac | of the next\n");
  EXPECT_THAT(readWholeFile(path_),
              testing::ContainsRegex("last words\n-- .* SIGSEGV; restart 1\n"));
}

TEST_F(LogFollowerTest, ANoteIsInTheFileThatHasReplacedTheLog) {
  LogFollower follower(false, 1u << 20);
  follower.add("dac", path_);
  std::filesystem::rename(path_, path_ + ".1");
  append(path_, "");

  follower.note("dac", "started, pid 7");

  EXPECT_THAT(readWholeFile(path_), HasSubstr("started, pid 7"));
  EXPECT_EQ(readWholeFile(path_ + ".1"), "");
  EXPECT_EQ(follower.takeLines(), "");
}

TEST_F(LogFollowerTest, ALogThatCouldNotBeOpenedCanBeAddedLater) {
  append(path_, "before\n");
  LogFollower follower(false, 1u << 20);
  {
    const mpf::test::NoDescriptors none;
    EXPECT_THROW(follower.add("dac", path_), std::system_error);
  }
  follower.add("dac", path_);

  append(path_, "one\n");

  EXPECT_EQ(follower.takeLines(), "dac | one\n");
}

TEST_F(LogFollowerTest, FollowsTheNewFileOfALogThatWasRemoved) {
  LogFollower follower(false, 1u << 20);
  follower.add("dac", path_);
  append(path_, "old\n");
  std::filesystem::remove(path_);
  follower.maintain();
  append(path_, "new\n");

  follower.maintain();

  EXPECT_TRUE(follower.hasMore());
  EXPECT_EQ(follower.takeLines(), "dac | old\ndac | new\n");
  append(path_, "next\n");
  pollfd poll{follower.descriptor(), POLLIN, 0};
  EXPECT_EQ(::poll(&poll, 1, 0), 1);
  EXPECT_EQ(follower.takeLines(), "dac | next\n");
  append(path_, std::string(std::size_t{3} << 20, '\n'));
  follower.maintain();
  struct stat status{};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_LT(status.st_blocks * 512, 2 << 20);
}

TEST_F(LogFollowerTest, ReturnsALongLogInParts) {
  LogFollower follower(false, std::uint64_t{1} << 30);
  follower.add("dac", path_);
  constexpr int kLines = 300'000;
  std::string text;
  for (int i = 0; i < kLines; ++i) text += (i % 2 == 0 ? "even\n" : "odd\n");
  append(path_, text);

  std::int64_t lines = 0;
  int parts = 0;
  do {
    lines += std::ranges::count(follower.takeLines(), '\n');
    ++parts;
  } while (follower.hasMore());

  EXPECT_EQ(lines, kLines);
  EXPECT_EQ(parts, 2) << text.size() << " bytes, a megabyte at a time";
}

TEST_F(LogFollowerTest, ReturnsALineWithoutAnEndInParts) {
  LogFollower follower(false, std::uint64_t{1} << 30);
  follower.add("dac", path_);
  append(path_, std::string(200'000, 'x'));

  EXPECT_GE(follower.takeLines().size(), 200'000u);
}

TEST_F(LogFollowerTest, ColoursNamesOnATerminal) {
  LogFollower follower(true, 1u << 20);
  follower.add("dac", path_);
  append(path_, "one\n");

  EXPECT_THAT(follower.takeLines(), testing::MatchesRegex("\x1b\\[3[1-6]mdac\x1b\\[0m \\| one\n"));
}

TEST_F(LogFollowerTest, RemovesTheFirstHalfOfALogThatIsTooLong) {
  constexpr std::uint64_t kMost = 1u << 20;
  LogFollower follower(false, kMost);
  follower.add("dac", path_);
  const std::string line(99, 'x');
  std::string last;
  for (int i = 0; i < 3'000; ++i) {
    std::string block;
    for (int j = 0; j < 10; ++j) block += line + "\n";
    append(path_, block + std::to_string(i) + "\n");
    last = follower.takeLines();
    struct stat status{};
    ASSERT_EQ(::stat(path_.c_str(), &status), 0);
    ASSERT_LE(static_cast<std::uint64_t>(status.st_blocks) * 512, kMost + 200'000);
  }
  EXPECT_THAT(last, HasSubstr("dac | 2999\n"));
}

TEST_F(LogFollowerTest, ALineWhoseRestIsRemovedIsNotJoinedWithALaterOne) {
  LogFollower follower(false, 1u << 20);
  follower.add("dac", path_);
  append(path_, "the first words");
  EXPECT_EQ(follower.takeLines(), "");
  std::string lines;
  while (lines.size() < std::size_t{3} << 20) lines += "a line\n";
  append(path_, lines);

  follower.maintain();

  EXPECT_THAT(follower.takeLines(), testing::StartsWith("dac | the first words\n"));
}

// tmpfs cannot remove the beginning of a file: it becomes a hole.
TEST_F(LogFollowerTest, DoesNotReadTheHoleOfALogThatIsTooLong) {
  const mpf::test::TemporaryFolder memory("/dev/shm/");
  const auto path = memory.file("dac.log");
  LogFollower follower(false, 1u << 20);
  follower.add("dac", path);
  append(path, std::string(std::size_t{3} << 20, '\n') + "last\n");

  follower.maintain();

  std::string text;
  do {
    text += follower.takeLines();
  } while (follower.hasMore());
  EXPECT_THAT(text, testing::EndsWith("dac | last\n"));
  EXPECT_EQ(text.find("\\x00"), std::string::npos);
}

}  // namespace
}  // namespace mpf::crate::test
