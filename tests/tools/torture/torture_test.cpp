// SPDX-License-Identifier: MIT
// `mpf torture`: everything holds when processes are stopped and killed at each step, and the
// program detects mistakes.
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/support/watchdog.h"
#include "tests/tools/tool.h"
#include "tests/tools/torture/may_trace.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing::Not;

class TortureTest : public testing::Test {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_THREAD__
    GTEST_SKIP() << "ThreadSanitizer does not follow processes that fork and start threads";
#endif
    if (!mayTrace()) GTEST_SKIP() << "this host does not let a process trace its children";
  }
  static Ended torture(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "torture");
    return runTool(std::move(arguments), "");
  }
  const Watchdog watchdog_{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(TortureTest, EverythingHoldsWhenProcessesAreKilledAtEachStep) {
  const auto ended = torture({"--duration", "0", "--mode", "kill"});

  EXPECT_EQ(ended.status, 0) << ended.out << ended.err;
  EXPECT_THAT(ended.out, AllOf(HasSubstr("\nheld: "), Not(HasSubstr("never reached"))));
}

TEST_F(TortureTest, EverythingHoldsWhenProcessesAreStoppedAtEachStep) {
  const auto ended = torture({"--duration", "0", "--mode", "stop"});

  EXPECT_EQ(ended.status, 0) << ended.out << ended.err;
  EXPECT_THAT(ended.out, AllOf(HasSubstr("\nheld: "), Not(HasSubstr("never reached"))));
}

TEST_F(TortureTest, TriesEveryInstructionUpToTheNextStep) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer turns one instruction into many";
#endif
  const auto ended =
      torture({"--every-instruction", "chunk_noted", "--role", "client", "--mode", "kill"});

  EXPECT_EQ(ended.status, 0) << ended.out << ended.err;
  EXPECT_THAT(ended.out, HasSubstr("\nheld: ")) << ended.out;
  std::istringstream row(ended.out.substr(ended.out.find("\nchunk_noted")));
  std::string name;
  int killed = 0;
  row >> name >> killed;
  EXPECT_GT(killed, 3);
}

TEST_F(TortureTest, WritesTheVerdictAsJson) {
  const auto path = testing::TempDir() + "mpf-torture-" + std::to_string(::getpid()) + ".json";

  const auto ended =
      torture({"--duration", "0", "--step", "link_created", "--seed", "7", "--json", path});

  const auto json = nlohmann::json::parse(std::ifstream(path));
  EXPECT_EQ(std::remove(path.c_str()), 0);
  EXPECT_EQ(ended.status, 0) << ended.out << ended.err;
  EXPECT_EQ(json.at("verdict"), "held");
  EXPECT_EQ(json.at("seed"), 7);
  EXPECT_EQ(json.at("never_reached"), nlohmann::json::array());
  EXPECT_EQ(json.at("steps").at(0).at("step"), "link_created");
  EXPECT_EQ(json.at("steps").at(0).at("client").at("killed"), 1);
  EXPECT_EQ(json.at("steps").at(0).at("server").at("killed"), 0) << "no server reaches it";
}

TEST_F(TortureTest, AStepThatIsNeverReachedMakesTheVerdictIncomplete) {
  const auto ended = torture({"--duration", "0", "--step", "link_created", "--role", "server"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.out,
              AllOf(HasSubstr("never reached: link_created\n"), HasSubstr("\nincomplete: ")));
}

// In a /dev/shm of its own, which has no room for all links of the survivors.
TEST_F(TortureTest, LeavesNothingIfItFailsAtTheStart) {
  constexpr int kNotAllowed = 77;
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    const auto user = ::geteuid() == 0 ? 0 : CLONE_NEWUSER;
    if (::unshare(CLONE_NEWNS | user) != 0) ::_exit(kNotAllowed);
    ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    if (::mount("tmpfs", "/dev/shm", "tmpfs", 0, "size=40k") != 0) ::_exit(kNotAllowed);

    const auto ended = torture({"--duration", "0", "--patience", "3"});

    EXPECT_EQ(ended.status, 1);
    EXPECT_THAT(ended.out, HasSubstr("\nfailed: 0 rounds "));
    EXPECT_TRUE(std::filesystem::is_empty("/dev/shm"));
    std::fflush(stdout);
    ::_exit(HasFailure() ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == kNotAllowed) GTEST_SKIP() << "this host allows no mount namespace";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

// A mistake that a test process makes on purpose, and the complaint that must follow.
struct Mistake {
  std::string name, patience, complaint;
};
std::ostream& operator<<(std::ostream& out, const Mistake& mistake) { return out << mistake.name; }

class MistakeTest : public TortureTest, public testing::WithParamInterface<Mistake> {};

TEST_P(MistakeTest, IsFound) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer makes every step slower than the patience of this test allows";
#endif
  // It ends at the complaint; the duration is no limit.
  const auto ended = torture({"--break", GetParam().name, "--patience", GetParam().patience,
                              "--step", "window_closed", "--duration", "1000000"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.out, AllOf(HasSubstr("\nfailed: "), HasSubstr(GetParam().complaint)));
}

INSTANTIATE_TEST_SUITE_P(
    Each, MistakeTest,
    testing::Values(Mistake{"lose-fate", "600", "each request has an end"},
                    // The slot contains invalid data or an old request; the complaint depends on
                    // which.
                    Mistake{"half-message", "30", ""},
                    Mistake{"keep-name", "30", "the successor could not open the name"},
                    Mistake{"stale", "600", "nothing stale is left; still there: mpf."},
                    Mistake{"leak", "600", "the survivors hold no more resources"}),
    [](const auto& mistake) {
      auto name = mistake.param.name;
      name.erase(name.find('-') == std::string::npos ? name.size() : name.find('-'), 1);
      return name;
    });

TEST(TortureStepsTest, AreAllDocumented) {
  std::set<std::string> explained;
  std::ifstream manual(MPF_TEST_TORTURE_MD);
  std::string line;
  while (std::getline(manual, line) && line != "## Steps") continue;
  while (std::getline(manual, line)) {
    if (line.starts_with("| `")) explained.insert(line.substr(3, line.find('`', 3) - 3));
  }
  std::istringstream listed(runTool({"torture", "--list"}, "").out);
  const std::set<std::string> steps{std::istream_iterator<std::string>(listed), {}};

  EXPECT_EQ(explained, steps);
}

TEST(TortureStepsTest, RefusesAnUnknownStepByName) {
  const auto ended = runTool({"torture", "--step", "unknown_step"}, "");

  EXPECT_EQ(ended.status, 2);
  EXPECT_THAT(ended.err, HasSubstr("no step \"unknown_step\"; `mpf torture --list` lists all"));
}

// The file is opened before the work, which may take hours.
TEST_F(TortureTest, FailsAtOnceWhenTheVerdictCannotBeWritten) {
  const auto ended =
      runTool({"torture", "--json", "/nowhere/verdict.json", "--duration", "1000000"}, "");

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err, HasSubstr("open /nowhere/verdict.json: No such file or directory"));
  EXPECT_EQ(ended.out, "");
}

}  // namespace
}  // namespace mpf::test
