// SPDX-License-Identifier: MIT
#include "benchmarks/stage/stage.h"

#include <signal.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <stdexcept>

namespace mpf::bench {
namespace {

// Both on one CPU, so that the tests run on a machine with a single CPU.
Stage smallStage() {
  const auto cpu = allowedCpus().front();
  return Stage({{cpu}, {cpu}}, {std::chrono::milliseconds(1), std::chrono::milliseconds(2)});
}

TEST(Stage, ReturnsTheFiguresOfTheRequester) {
  Act act;
  act.requester = [](const Scene& scene) { scene.figures().value = 42; };

  const auto outcome = smallStage().run(act);

  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(outcome.figures.value, 42);
}

TEST(Stage, StartsTheRequesterWhenTheServerIsReady) {
  Act act;
  act.scratchBytes = sizeof(int);
  act.server = [](const Scene& scene) {
    *reinterpret_cast<int*>(scene.scratch().data()) = 7;
    scene.ready();
    for (;;) ::pause();
  };
  act.requester = [](const Scene& scene) {
    scene.figures().value = *reinterpret_cast<int*>(scene.scratch().data());
  };

  const auto outcome = smallStage().run(act);

  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(outcome.figures.value, 7);
}

TEST(Stage, ReportsWhatTheRequesterThrew) {
  Act act;
  act.requester = [](const Scene&) { throw std::runtime_error("no such device"); };

  EXPECT_EQ(smallStage().run(act).error, "requester: no such device");
}

TEST(Stage, NamesTheSignalThatKilledTheServer) {
  Act act;
  act.server = [](const Scene& scene) {
    scene.ready();
    ::raise(SIGKILL);
  };
  act.requester = [](const Scene&) {
    for (;;) ::pause();
  };

  EXPECT_EQ(smallStage().run(act).error, "server was killed by signal 9");
}

TEST(Stage, LeavesNoProcessBehind) {
  Act act;
  act.scratchBytes = sizeof(int);
  act.server = [](const Scene& scene) {
    *reinterpret_cast<int*>(scene.scratch().data()) = ::getpid();
    scene.ready();
    for (;;) ::pause();
  };
  act.requester = [](const Scene& scene) {
    scene.figures().value = *reinterpret_cast<int*>(scene.scratch().data());
  };

  const auto pid = static_cast<int>(smallStage().run(act).figures.value);

  EXPECT_GT(pid, 0);
  EXPECT_NE(::kill(pid, 0), 0);
}

}  // namespace
}  // namespace mpf::bench
