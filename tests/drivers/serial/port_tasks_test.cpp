// SPDX-License-Identifier: MIT
#include "drivers/serial/port_tasks.h"

#include <poll.h>

#include <future>
#include <gtest/gtest.h>
#include <thread>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

// The thread of the test is the port's thread.
class PortTasksTest : public testing::Test {
 protected:
  [[nodiscard]] bool isReadable() const {
    pollfd bell{tasks_.descriptor(), POLLIN, 0};
    return ::poll(&bell, 1, 0) == 1;
  }
  // Runs tasks until `isEnough`, which a task sets.
  void runUntil(const bool& isEnough) {
    while (!isEnough) {
      pollfd bell{tasks_.descriptor(), POLLIN, 0};
      ASSERT_EQ(::poll(&bell, 1, -1), 1);
      tasks_.runAll();
    }
  }

  Watchdog watchdog_{"port tasks test"};
  PortTasks tasks_;
};

TEST_F(PortTasksTest, AreReadableFromAWakeUntilTheyAreRun) {
  EXPECT_FALSE(isReadable());
  tasks_.wake();
  tasks_.wake();
  EXPECT_TRUE(isReadable());

  tasks_.runAll();

  EXPECT_FALSE(isReadable());
  tasks_.runAll();  // does not block
}

TEST_F(PortTasksTest, RunOnThePortsThreadWhileTheCallerWaits) {
  bool hasRun = false;
  std::thread::id ranOn;
  auto caller = std::async(std::launch::async, [&] {
    tasks_.call([&] {
      ranOn = std::this_thread::get_id();
      hasRun = true;
    });
    return hasRun;
  });

  runUntil(hasRun);

  EXPECT_TRUE(caller.get());
  EXPECT_EQ(ranOn, std::this_thread::get_id());
}

TEST_F(PortTasksTest, OfManyCallersRunOnceEach) {
  constexpr int kCallers = 8;
  constexpr int kCalls = 100;
  int runs = 0;
  bool isEnough = false;
  std::vector<std::jthread> callers;
  for (int i = 0; i < kCallers; ++i) {
    callers.emplace_back([&] {
      for (int call = 0; call < kCalls; ++call)
        tasks_.call([&] { isEnough = ++runs == kCallers * kCalls; });
    });
  }

  runUntil(isEnough);
  callers.clear();

  EXPECT_EQ(runs, kCallers * kCalls);
  tasks_.runAll();
  EXPECT_EQ(runs, kCallers * kCalls);
}

TEST_F(PortTasksTest, MayBeFinishedAfterTheyHaveBegun) {
  bool begun = false;
  bool done = false;
  auto caller = std::async(std::launch::async, [&] {
    tasks_.callUntil(done, [&] { begun = true; });
    return done;
  });
  runUntil(begun);
  EXPECT_EQ(caller.wait_for(std::chrono::seconds(0)), std::future_status::timeout);

  tasks_.finish(done);

  EXPECT_TRUE(caller.get());
}

TEST_F(PortTasksTest, LetTheWaitingCallerPassOtherTasks) {
  bool done = false;
  int asked = 0;
  auto caller = std::async(std::launch::async, [&] {
    tasks_.callUntil(
        done, [] {},
        [&] {
          tasks_.call([&] {
            if (++asked == 3) tasks_.finish(done);
          });
        });
    return asked;
  });

  runUntil(done);

  EXPECT_EQ(caller.get(), 3);
}

}  // namespace
}  // namespace mpf::test
