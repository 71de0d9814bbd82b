// SPDX-License-Identifier: MIT
#include "shm/process_condition.h"

#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <mutex>
#include <optional>
#include <thread>

#include "base/system_call.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

// The destructor of a std::condition_variable would wait for a thread that the child does not have.
TEST(ProcessConditionTest, MayBeDestroyedInTheChildOfAFork) {
  const Watchdog watchdog("process condition");
  std::mutex mutex;
  bool isOver = false;
  bool isWaiting = false;
  std::optional<ProcessCondition> condition(std::in_place);
  std::thread waiting([&] {
    std::unique_lock lock(mutex);
    isWaiting = true;
    condition->get().wait(lock, [&] { return isOver; });
  });
  for (bool waits = false; !waits;) {  // it releases the mutex when it waits
    const std::lock_guard lock(mutex);
    waits = isWaiting;
  }

  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    ::alarm(60);
    condition.reset();
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  {
    const std::lock_guard lock(mutex);
    isOver = true;
  }
  condition->get().notify_all();
  waiting.join();

  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace mpf::test
