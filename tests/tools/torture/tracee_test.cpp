// SPDX-License-Identifier: MIT
// Tracee: a child that passes steps, and notes in shared memory how far it is.
#include "tools/torture/tracee.h"

#include <sys/mman.h>
#include <sys/wait.h>

#include <atomic>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <new>

#include "base/step.h"
#include "base/system_call.h"
#include "tests/tools/torture/may_trace.h"
#include "tools/torture/processes.h"

namespace mpf::torture {
namespace {

using testing::ElementsAre;
using testing::Pair;

constexpr auto kPatience = std::chrono::hours(1);
constexpr int kTurns = 5;

class TraceeTest : public testing::Test {
 protected:
  struct Progress {
    std::atomic<int> begun{0};  // turns
    std::atomic<int> ended{0};
  };

  void SetUp() override {
    if (!test::mayTrace()) GTEST_SKIP() << "this host does not let a process trace its children";
    void* memory = ::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE,
                          MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(memory, MAP_FAILED);
    progress_ = new (memory) Progress;
    pid_ = processes_.startHeld([this] { return play(); });
    tracee_.emplace(pid_, marks_);
    processes_.setTracee(&*tracee_);
  }
  void TearDown() override {
    if (progress_ == nullptr) return;
    processes_.killAll();
    ::munmap(progress_, sizeof(Progress));
  }

  // The child: two steps in each turn.
  [[nodiscard]] int play() const {
    for (int turn = 0; turn < kTurns; ++turn) {
      ++progress_->begun;
      MPF_STEP(tracee_test_begun);
      ++progress_->ended;
      MPF_STEP(tracee_test_ended);
    }
    return 7;
  }
  void runToPlace() {
    processes_.openGate();
    while (!tracee_->isThere() && !tracee_->isGone()) processes_.handleEvents(kPatience);
  }
  void runToEnd() {
    while (!tracee_->isGone()) processes_.handleEvents(kPatience);
  }

  Marks marks_ = Marks::ofThisProgram();
  Processes processes_;
  Progress* progress_ = nullptr;
  pid_t pid_ = 0;
  std::optional<Tracee> tracee_;
};

TEST_F(TraceeTest, StopsAtTheChosenVisitOfAStep) {
  tracee_->aim({.mark = "tracee_test_begun", .hit = 3});

  runToPlace();

  ASSERT_TRUE(tracee_->isThere());
  EXPECT_EQ(progress_->begun.load(), 3);
  EXPECT_EQ(progress_->ended.load(), 2);
}

TEST_F(TraceeTest, ContinuesToItsEndAfterItsRelease) {
  tracee_->aim({.mark = "tracee_test_ended", .hit = 1});
  runToPlace();
  ASSERT_TRUE(tracee_->isThere());

  tracee_->release();
  EXPECT_FALSE(tracee_->isThere());
  runToEnd();

  ASSERT_TRUE(WIFEXITED(tracee_->status()));
  EXPECT_EQ(WEXITSTATUS(tracee_->status()), 7);
  EXPECT_EQ(progress_->ended.load(), kTurns);
}

TEST_F(TraceeTest, IsKilledAtThePlace) {
  tracee_->aim({.mark = "tracee_test_begun", .hit = 2});
  runToPlace();

  tracee_->kill();
  runToEnd();

  ASSERT_TRUE(WIFSIGNALED(tracee_->status()));
  EXPECT_EQ(WTERMSIG(tracee_->status()), SIGKILL);
  EXPECT_EQ(progress_->begun.load(), 2);
  EXPECT_EQ(progress_->ended.load(), 1);
}

TEST_F(TraceeTest, EndsWithoutAStopWhenThePlaceIsNotReached) {
  tracee_->aim({.mark = "tracee_test_begun", .hit = kTurns + 1});

  runToPlace();

  EXPECT_FALSE(tracee_->isThere());
  EXPECT_TRUE(tracee_->isGone());
  EXPECT_EQ(WEXITSTATUS(tracee_->status()), 7);
}

TEST_F(TraceeTest, CountsTheVisitsOfWatchedSteps) {
  tracee_->watch({"tracee_test_begun", "tracee_test_ended"});

  processes_.openGate();
  runToEnd();

  EXPECT_THAT(tracee_->hits(),
              ElementsAre(Pair("tracee_test_begun", kTurns), Pair("tracee_test_ended", kTurns)));
  EXPECT_EQ(WEXITSTATUS(tracee_->status()), 7);
}

// The increment between the two steps is more than one instruction and fewer than a thousand.
TEST_F(TraceeTest, StopsAtTheNextStepIfItComesBeforeTheLastInstruction) {
  tracee_->aim({.mark = "tracee_test_begun", .hit = 2, .instructions = 1000, .upToNextMark = true});

  runToPlace();

  ASSERT_TRUE(tracee_->isThere());
  EXPECT_TRUE(tracee_->cameToNextMark());
  EXPECT_EQ(progress_->ended.load(), 2);
}

TEST_F(TraceeTest, StopsAfterSingleInstructions) {
  tracee_->aim({.mark = "tracee_test_begun", .hit = 2, .instructions = 1, .upToNextMark = true});

  runToPlace();

  ASSERT_TRUE(tracee_->isThere());
  EXPECT_FALSE(tracee_->cameToNextMark());
  EXPECT_EQ(progress_->ended.load(), 1) << "the increment has not been executed";
}

}  // namespace
}  // namespace mpf::torture
