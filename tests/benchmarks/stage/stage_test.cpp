// SPDX-License-Identifier: MIT
#include "benchmarks/stage/stage.h"

#include <signal.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <stdexcept>
#include <string>

namespace mpf::bench {
namespace {

// Both on one CPU, so that the tests run on a machine with a single CPU.
Stage smallStage() {
  const auto cpu = allowedCpus().front();
  return Stage({{cpu}, {cpu}}, {std::chrono::milliseconds(1), std::chrono::milliseconds(2)});
}

TEST(Stage, ReturnsTheFiguresOfTheRequester) {
  Workload workload;
  workload.requester = [](const RunContext& context) { context.figures().value = 42; };

  const auto outcome = smallStage().run(workload);

  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(outcome.figures.value, 42);
}

TEST(Stage, StartsTheRequesterWhenTheServerIsReady) {
  Workload workload;
  workload.scratchBytes = sizeof(int);
  workload.server = [](const RunContext& context) {
    *reinterpret_cast<int*>(context.scratch().data()) = 7;
    context.ready();
    for (;;) ::pause();
  };
  workload.requester = [](const RunContext& context) {
    context.figures().value = *reinterpret_cast<int*>(context.scratch().data());
  };

  const auto outcome = smallStage().run(workload);

  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(outcome.figures.value, 7);
}

TEST(Stage, ReportsWhatTheRequesterThrew) {
  Workload workload;
  workload.requester = [](const RunContext&) { throw std::runtime_error("no such device"); };

  EXPECT_EQ(smallStage().run(workload).error, "requester: no such device");
}

// With a limit that doubles until the requester gets so far within it.
TEST(Stage, SaysWhatTheRequesterWaitedForWhenItDoesNotEnd) {
  Workload workload;
  workload.requester = [](const RunContext& context) {
    context.waitsFor("7 replies");
    context.got(3);
    for (;;) ::pause();
  };
  std::string error;
  for (workload.grace = std::chrono::milliseconds(1); !error.ends_with("3"); workload.grace *= 2)
    error = smallStage().run(workload).error;

  EXPECT_TRUE(error.starts_with("neither process ended within ")) << error;
  EXPECT_TRUE(error.ends_with(" s; the requester waited for 7 replies, and had got 3")) << error;
}

TEST(Stage, NamesTheSignalThatKilledTheServer) {
  Workload workload;
  workload.server = [](const RunContext& context) {
    context.ready();
    ::raise(SIGKILL);
  };
  workload.requester = [](const RunContext&) {
    for (;;) ::pause();
  };

  EXPECT_EQ(smallStage().run(workload).error, "server was killed by signal 9");
}

TEST(Stage, LeavesNoProcessBehind) {
  Workload workload;
  workload.scratchBytes = sizeof(int);
  workload.server = [](const RunContext& context) {
    *reinterpret_cast<int*>(context.scratch().data()) = ::getpid();
    context.ready();
    for (;;) ::pause();
  };
  workload.requester = [](const RunContext& context) {
    context.figures().value = *reinterpret_cast<int*>(context.scratch().data());
  };

  const auto pid = static_cast<int>(smallStage().run(workload).figures.value);

  EXPECT_GT(pid, 0);
  EXPECT_NE(::kill(pid, 0), 0);
}

}  // namespace
}  // namespace mpf::bench
