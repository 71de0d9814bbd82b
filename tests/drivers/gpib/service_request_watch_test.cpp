// SPDX-License-Identifier: MIT
#include "drivers/gpib/service_request_watch.h"

#include <atomic>
#include <gtest/gtest.h>
#include <thread>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class ServiceRequestWatchTest : public testing::Test {
 protected:
  static void waitFor(const std::atomic<int>& count, int least) {
    while (count < least) std::this_thread::yield();
  }

  Watchdog watchdog_{"service request watch test"};
  std::atomic<bool> isActive_{false};
  std::atomic<bool> isBusy_{false};
  std::atomic<int> looks_{0};
  std::atomic<int> calls_{0};
  ServiceRequestWatch watch_{[this] {
                               const auto seen =
                                   isBusy_ ? std::nullopt : std::optional(isActive_.load());
                               ++looks_;
                               return seen;
                             },
                             1ms};
};

TEST_F(ServiceRequestWatchTest, LooksWhileThereAreHandlers) {
  {
    const auto entry = watch_.add([this] { ++calls_; });
    waitFor(looks_, 3);
    EXPECT_EQ(calls_, 0);

    isActive_ = true;

    waitFor(calls_, 3);  // again and again
  }
  const int calls = calls_;
  const int looks = looks_;
  std::this_thread::sleep_for(10ms);
  EXPECT_EQ(calls_, calls);
  EXPECT_LE(looks_, looks + 1);  // one may have begun
}

TEST_F(ServiceRequestWatchTest, AReportCallsEachHandlerWithoutALook) {
  watch_.setReported(true);
  std::atomic<int> others{0};
  const auto one = watch_.add([this] { ++calls_; });
  const auto other = watch_.add([&] { ++others; });

  watch_.report();

  waitFor(calls_, 1);
  waitFor(others, 1);
}

// Otherwise a request for service during a long operation would be lost: its report does not come
// again.
TEST_F(ServiceRequestWatchTest, ALineThatCannotBeSeenIsStillActive) {
  watch_.setReported(true);
  const auto entry = watch_.add([this] { ++calls_; });
  waitFor(looks_, 1);
  isBusy_ = true;

  watch_.report();

  waitFor(calls_, 3);
}

TEST_F(ServiceRequestWatchTest, ANewHandlerOfABusyBusLearnsOfAnActiveLineLater) {
  watch_.setReported(true);
  isActive_ = true;  // its report was before
  isBusy_ = true;
  const auto entry = watch_.add([this] { ++calls_; });
  waitFor(looks_, 1);

  isBusy_ = false;

  waitFor(calls_, 1);
}

TEST_F(ServiceRequestWatchTest, AReportedLineIsLookedAtWhileItIsActive) {
  watch_.setReported(true);
  const auto entry = watch_.add([this] { ++calls_; });
  waitFor(looks_, 1);  // a new handler learns whether the line is active
  EXPECT_EQ(calls_, 0);
  isActive_ = true;

  watch_.report();

  waitFor(calls_, 3);
  const int looks = looks_;
  isActive_ = false;
  waitFor(looks_, looks + 1);  // the look that finds it inactive
}

TEST_F(ServiceRequestWatchTest, AHandlerThatComesLateIsCalledForAnActiveLine) {
  watch_.setReported(true);
  isActive_ = true;
  watch_.report();

  const auto entry = watch_.add([this] { ++calls_; });

  waitFor(calls_, 1);
}

}  // namespace
}  // namespace mpf::test
