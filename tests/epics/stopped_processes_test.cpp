// SPDX-License-Identifier: MIT
#include "epics/stopped_processes.h"

#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/shm/child.h"

namespace mpf::test {
namespace {

TEST(StoppedProcesses, AProcessIsStoppedAfterTwoLooksUntilItRuns) {
  Child child([](Child::Self& self) { self.stay(); });
  StoppedProcesses stopped;
  stopped.look({child.pid()});
  stopped.look({child.pid()});
  EXPECT_FALSE(stopped.contains(child.pid())) << "it sleeps";

  child.stop();
  stopped.look({child.pid()});
  EXPECT_FALSE(stopped.contains(child.pid())) << "perhaps for a moment";
  stopped.look({child.pid()});
  EXPECT_TRUE(stopped.contains(child.pid()));

  child.resume();
  stopped.look({child.pid()});
  EXPECT_FALSE(stopped.contains(child.pid()));
}

TEST(StoppedProcesses, AProcessThatDoesNotExistIsNotStopped) {
  StoppedProcesses stopped;
  stopped.look({0, -1, 1 << 30});
  stopped.look({0, -1, 1 << 30});

  EXPECT_FALSE(stopped.contains(0));
  EXPECT_FALSE(stopped.contains(1 << 30));
}

}  // namespace
}  // namespace mpf::test
