// SPDX-License-Identifier: MIT
#include "base/stop_signals.h"

#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <gtest/gtest.h>
#include <optional>
#include <thread>

#include "base/system_call.h"
#include "tests/base/child_process.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

// Sends a signal to another thread, which executes the callback.
class StopSignalsTest : public testing::Test {
 public:  // for callbacks
  void TearDown() override {
    if (other.joinable()) other.join();
  }
  // Returns when the other thread executes `callback`.
  void interruptOther(StopSignals::Callback callback) {
    signals.emplace(callback, this);
    // NOLINTNEXTLINE(bugprone-bad-signal-to-kill-thread): it is handled
    ::pthread_kill(other.native_handle(), SIGTERM);
    while (!entered) std::this_thread::yield();
  }

  Watchdog watchdog{"stop signals test"};
  std::atomic<bool> entered{false};
  std::atomic<bool> isGone{false};
  std::atomic<bool> mayLeave{false};
  bool wasGone = false;
  std::optional<StopSignals> signals;
  std::thread other{[this] {
    while (!entered) std::this_thread::yield();
  }};
};

// The program may destroy the callback's argument after the destructor.
TEST_F(StopSignalsTest, DestructorWaitsUntilNoThreadExecutesTheCallback) {
  interruptOther([](void* test) noexcept {
    auto& self = *static_cast<StopSignalsTest*>(test);
    self.entered = true;
    // so that a destructor that does not wait returns first
    const timespec aWhile{.tv_sec = 0, .tv_nsec = 20'000'000};
    ::nanosleep(&aWhile, nullptr);
    self.wasGone = self.isGone;
  });
  signals.reset();
  isGone = true;
  other.join();
  EXPECT_FALSE(wasGone);
}

TEST_F(StopSignalsTest, DestructorReturnsInAChildForkedDuringTheCallback) {
  interruptOther([](void* test) noexcept {
    auto& self = *static_cast<StopSignalsTest*>(test);
    self.entered = true;
    while (!self.mayLeave) ::usleep(1000);
  });
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    ::alarm(60);  // the child does not have the other thread: a wait for it would never end
    signals.reset();
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  mayLeave = true;
  EXPECT_EQ(status, 0);
}

TEST_F(StopSignalsTest, AChildMayCreateOneWhileAnotherThreadOfItsParentDoes) {
  entered = true;  // the thread of the fixture ends
  std::atomic<bool> isOver{false};
  std::thread creating([&isOver] {
    while (!isOver) {
      const StopSignals shortLived([](void*) noexcept {}, nullptr);
    }
  });

  for (int i = 0; i < 100 && !HasFailure(); ++i) {
    EXPECT_EQ(endOf([] {
                ::alarm(60);  // the child does not have the thread that may hold a lock
                const StopSignals own([](void*) noexcept {}, nullptr);
                return 0;
              }),
              0);
  }

  isOver = true;
  creating.join();
}

}  // namespace
}  // namespace mpf::test
