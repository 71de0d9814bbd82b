// SPDX-License-Identifier: MIT
// ChildProcess: the gate before the program, its environment, and starts that fail.
#include "crate/supervisor/child_process.h"

#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>

#include <mpf/clock.h>

#include "base/system_call.h"
#include "base/whole_file.h"
#include "tests/support/no_descriptors.h"
#include "tests/support/temporary_folder.h"

namespace mpf::crate::test {
namespace {

using testing::HasSubstr;

class ChildProcessTest : public testing::Test {
 protected:
  ProcessPlan planOf(const std::string& script) {
    ProcessPlan plan;
    plan.name = "child";
    plan.command = {"/bin/sh", "-c", script};
    plan.workingFolder = folder_.path().string();
    return plan;
  }
  static int wait(pid_t pid) {
    int status = 0;
    checkCall(::waitpid(pid, &status, 0), "waitpid");
    return status;
  }
  // Lets the program run, and waits until it is known whether it does.
  static std::string resultOf(ChildProcess& child) {
    child.open();
    pollfd poll{child.descriptor(), POLLIN, 0};
    checkCall(::poll(&poll, 1, -1), "poll");
    return child.tryResult().value();
  }
  mpf::test::TemporaryFolder folder_;
  std::string log_ = folder_.file("child.log");
};

TEST_F(ChildProcessTest, RunsInItsFolderWithItsEnvironment) {
  auto plan = planOf("pwd; echo $A; echo error >&2; exit 3");
  plan.environment["A"] = "value of A";
  ChildProcess child(plan, log_);
  EXPECT_EQ(child.startTicks(), startTicksOf(child.pid()));

  EXPECT_EQ(resultOf(child), "");

  EXPECT_EQ(WEXITSTATUS(wait(child.pid())), 3);
  EXPECT_EQ(readWholeFile(log_),
            std::filesystem::canonical(folder_.path()).string() + "\nvalue of A\nerror\n");
}

TEST_F(ChildProcessTest, DoesNotRunIfTheSupervisorEndsFirst) {
  std::optional<ChildProcess> child(std::in_place, planOf("echo ran"), log_);
  const auto pid = child->pid();

  child.reset();

  EXPECT_EQ(wait(pid), 0);
  EXPECT_EQ(readWholeFile(log_), "");
}

TEST_F(ChildProcessTest, SaysWhyAProgramCannotBeExecuted) {
  auto plan = planOf("");
  plan.command = {folder_.file("absent")};
  ChildProcess absent(plan, log_);
  EXPECT_EQ(resultOf(absent), "No such file or directory");
  EXPECT_EQ(WEXITSTATUS(wait(absent.pid())), 127);

  plan.command = {folder_.write("text", "no program")};
  ChildProcess text(plan, log_);
  EXPECT_EQ(resultOf(text), "Permission denied");
  wait(text.pid());

  plan.user = "no-such-user";
  EXPECT_THAT([&] { ChildProcess(plan, log_); },
              testing::ThrowsMessage<std::runtime_error>("there is no user \"no-such-user\""));
}

TEST_F(ChildProcessTest, AppendsToItsLog) {
  for (const std::string word : {"one", "two"}) {
    ChildProcess child(planOf("echo " + word), log_);
    EXPECT_EQ(resultOf(child), "");
    wait(child.pid());
  }
  EXPECT_EQ(readWholeFile(log_), "one\ntwo\n");
}

TEST(StartTicks, IdentifyAProcess) {
  EXPECT_NE(startTicksOf(::getpid()), 0U);
  EXPECT_EQ(startTicksOf(999'999'999), 0U);
  const auto child = ::fork();
  if (child == 0) ::_exit(0);
  siginfo_t ended{};
  ASSERT_EQ(::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOWAIT), 0);
  EXPECT_EQ(startTicksOf(child), 0U) << "a zombie";
  ::waitpid(child, nullptr, 0);
}

TEST(StartTicks, AreUnknownWithoutADescriptor) {
  const mpf::test::NoDescriptors none;

  EXPECT_THROW(static_cast<void>(startTicksOf(::getpid())), std::system_error);
}

TEST(StartTicks, AreATimeOfTheMonotonicClock) {
  const auto startedNs = startNsOf(startTicksOf(::getpid()));

  EXPECT_LE(startedNs, Clock::nowNs());
  EXPECT_GT(startedNs, 0);
}

}  // namespace
}  // namespace mpf::crate::test
