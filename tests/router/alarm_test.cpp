// SPDX-License-Identifier: MIT
// Alarm: calls back once, at the earliest of its times.
#include "router/alarm.h"

#include <gtest/gtest.h>
#include <kj/async-io.h>

#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

class AlarmTest : public testing::Test {
 public:
  ~AlarmTest() noexcept override = default;

 protected:
  void runFor(kj::Duration time) {
    io_.provider->getTimer().afterDelay(time).wait(io_.waitScope);
    io_.waitScope.poll();
  }

  const mpf::test::Watchdog watchdog_{"alarm"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  int calls_ = 0;
};

TEST_F(AlarmTest, CallsOnceAtTheEarliestTime) {
  Alarm alarm(io_.provider->getTimer(), [&] { ++calls_; });

  alarm.setAt(Deadline::after(std::chrono::milliseconds(20)));
  alarm.setAt(Deadline::after(std::chrono::milliseconds(1)));
  alarm.setAt(Deadline::after(std::chrono::milliseconds(10)));
  while (calls_ == 0) runFor(kj::MILLISECONDS);
  runFor(30 * kj::MILLISECONDS);

  EXPECT_EQ(calls_, 1);
}

TEST_F(AlarmTest, MayBeSetAgainByItsCallback) {
  Alarm* again = nullptr;
  Alarm alarm(io_.provider->getTimer(), [&] {
    if (++calls_ < 3) again->setAt(Deadline::after(Nanoseconds(0)));
  });
  again = &alarm;

  alarm.setAt(Deadline::after(Nanoseconds(0)));
  while (calls_ < 3) runFor(kj::MILLISECONDS);
  runFor(10 * kj::MILLISECONDS);

  EXPECT_EQ(calls_, 3);
}

TEST_F(AlarmTest, NeverIsNotATime) {
  Alarm alarm(io_.provider->getTimer(), [&] { ++calls_; });

  alarm.setAt(Deadline::never());
  runFor(kj::MILLISECONDS);

  EXPECT_EQ(calls_, 0);
}

}  // namespace
}  // namespace mpf::router::test
