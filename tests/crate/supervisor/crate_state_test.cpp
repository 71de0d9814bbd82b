// SPDX-License-Identifier: MIT
// CrateState: written and read; damaged files and files of another boot.
#include "crate/supervisor/crate_state.h"

#include <unistd.h>

#include <filesystem>
#include <gtest/gtest.h>
#include <system_error>

#include "base/whole_file.h"
#include "crate/supervisor/child_process.h"
#include "tests/support/no_descriptors.h"
#include "tests/support/temporary_folder.h"

namespace mpf::crate::test {
namespace {

class CrateStateTest : public testing::Test {
 protected:
  CrateStateTest() {
    state_.file = "/etc/lab.toml";
    state_.processes.push_back({"dac", 12, 345, 6, "mpf-x 'a b'", true, "user=''"});
    state_.write(path_);
  }
  mpf::test::TemporaryFolder folder_;
  std::string path_ = folder_.file("state.json");
  CrateState state_;
};

TEST_F(CrateStateTest, IsReadAsItWasWritten) {
  const auto read = CrateState::read(path_);

  EXPECT_EQ(read.file, "/etc/lab.toml");
  ASSERT_EQ(read.processes.size(), 1U);
  const auto& one = read.processes[0];
  EXPECT_EQ(one.name, "dac");
  EXPECT_EQ(one.pid, 12);
  EXPECT_EQ(one.startTicks, 345U);
  EXPECT_EQ(one.restarts, 6);
  EXPECT_EQ(one.command, "mpf-x 'a b'");
  EXPECT_TRUE(one.isStopRequested);
  EXPECT_EQ(one.context, "user=''");
}

// The file that would replace the old one cannot be written.
TEST_F(CrateStateTest, IsOverwrittenOnAFullDisk) {
  for (const int restarts : {7, 8}) {
    std::filesystem::create_symlink("/dev/full", path_ + ".new");
    state_.processes[0].restarts = restarts;
    state_.processes[0].command = restarts == 7 ? "a longer command" : "x";

    state_.write(path_);

    const auto read = CrateState::read(path_);
    ASSERT_EQ(read.processes.size(), 1U);
    EXPECT_EQ(read.processes[0].restarts, restarts);
    EXPECT_EQ(read.processes[0].command, state_.processes[0].command);
  }
}

TEST_F(CrateStateTest, OnAFullDiskTheOldOneStaysIfTheNewOneDoesNotFit) {
  std::filesystem::create_symlink("/dev/full", path_ + ".new");
  state_.processes[0].command = std::string(100'000, 'x');

  EXPECT_THROW(state_.write(path_), std::system_error);

  EXPECT_EQ(CrateState::read(path_).processes.at(0).command, "mpf-x 'a b'");
}

TEST_F(CrateStateTest, AProcessThatHasEndedIsNotRunning) {
  constexpr pid_t kNone = 999'999'999;
  state_.processes = {{"ended when recorded", kNone, 0, 0, "", false, ""},
                      {"ended later", kNone, 345, 0, "", false, ""},
                      {"running", ::getpid(), startTicksOf(::getpid()), 0, "", false, ""}};

  const auto running = state_.running();

  ASSERT_EQ(running.size(), 1U);
  EXPECT_EQ(running[0].name, "running");
}

TEST_F(CrateStateTest, OfAnOlderVersionHasNoContext) {
  auto text = readWholeFile(path_);
  const auto at = text.find("\"context\"");
  text.replace(at, 9, "\"other\"");

  const auto read = CrateState::read(folder_.write("other", text));

  ASSERT_EQ(read.processes.size(), 1U);
  EXPECT_EQ(read.processes[0].context, "");
}

TEST_F(CrateStateTest, OfAnotherBootCountsAsEmpty) {
  auto text = readWholeFile(path_);
  const auto at = text.find("\"boot\": \"") + 9;
  text[at] = text[at] == '0' ? '1' : '0';

  EXPECT_TRUE(CrateState::read(folder_.write("other", text)).processes.empty());
}

TEST_F(CrateStateTest, ThatIsDamagedCountsAsEmpty) {
  const auto text = readWholeFile(path_);
  for (std::size_t length = 0; length + 2 < text.size(); ++length) {
    const auto cut = folder_.write("cut", text.substr(0, length));
    ASSERT_TRUE(CrateState::read(cut).processes.empty()) << length;
  }
  EXPECT_TRUE(CrateState::read(folder_.file("absent")).processes.empty());
  EXPECT_TRUE(CrateState::read(folder_.write("list", "[1]")).processes.empty());
}

TEST_F(CrateStateTest, ThatCannotBeOpenedForLackOfDescriptorsIsAnError) {
  const mpf::test::NoDescriptors none;

  EXPECT_THROW(static_cast<void>(CrateState::read(path_)), std::system_error);
}

}  // namespace
}  // namespace mpf::crate::test
