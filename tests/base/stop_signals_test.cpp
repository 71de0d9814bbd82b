// SPDX-License-Identifier: MIT
#include <mpf/base/stop_signals.h>

#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <gtest/gtest.h>
#include <optional>
#include <thread>

#include <mpf/base/system_call.h>
#include <mpf/tests/support/watchdog.h>

namespace mpf::test {
namespace {

// Another thread, which the signal interrupts.
class StopSignalsTest : public testing::Test {
 public:  // for callbacks
  void TearDown() override {
    if (other_.joinable()) other_.join();
  }
  // Returns once the other thread is in `callback`.
  void interruptOther(StopSignals::Callback callback) {
    signals_.emplace(callback, this);
    ::pthread_kill(other_.native_handle(), SIGTERM);
    while (!entered_) std::this_thread::yield();
  }

  Watchdog watchdog_{"stop signals test"};
  std::atomic<bool> entered_{false};
  std::atomic<bool> isGone_{false};
  std::atomic<bool> mayLeave_{false};
  bool wasGone_ = false;
  std::optional<StopSignals> signals_;
  std::thread other_{[this] {
    while (!entered_) std::this_thread::yield();
  }};
};

// What the callback uses may be destroyed right after.
TEST_F(StopSignalsTest, EndOnceNoThreadIsInTheCallback) {
  interruptOther([](void* test) noexcept {
    auto& self = *static_cast<StopSignalsTest*>(test);
    self.entered_ = true;
    const timespec aWhile{.tv_sec = 0, .tv_nsec = 20'000'000};  // for an end that does not wait to come first
    ::nanosleep(&aWhile, nullptr);
    self.wasGone_ = self.isGone_;
  });
  signals_.reset();
  isGone_ = true;
  other_.join();
  EXPECT_FALSE(wasGone_);
}

TEST_F(StopSignalsTest, EndInAChildThatWasForkedBesideTheCallback) {
  interruptOther([](void* test) noexcept {
    auto& self = *static_cast<StopSignalsTest*>(test);
    self.entered_ = true;
    while (!self.mayLeave_) ::usleep(1000);
  });
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    ::alarm(60);  // the other thread is not here: to wait for it is to wait for ever
    signals_.reset();
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  mayLeave_ = true;
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace mpf::test
