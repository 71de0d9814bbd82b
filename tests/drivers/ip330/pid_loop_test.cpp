// SPDX-License-Identifier: MIT
#include "drivers/ip330/pid_loop.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

PidLoop loopOf(double kp, double ki, double kd) {
  PidLoop loop;
  loop.kp = kp;
  loop.ki = ki;
  loop.kd = kd;
  loop.lowLimit = 0;
  loop.highLimit = 100;
  loop.setPoint = 10;
  return loop;
}

TEST(PidLoop, HasNoChangeOfErrorInItsFirstStep) {
  auto loop = loopOf(2, 0, 3);
  loop.step(4, 0.5);
  EXPECT_DOUBLE_EQ(loop.terms().error, 6);
  EXPECT_DOUBLE_EQ(loop.terms().p, 12);
  EXPECT_DOUBLE_EQ(loop.terms().d, 0);
  loop.step(5, 0.5);
  EXPECT_DOUBLE_EQ(loop.terms().d, 2 * 3 * (-1 / 0.5));
}

TEST(PidLoop, StartsWithThePresentOutput) {
  auto loop = loopOf(1, 2, 0);
  loop.turnOn(42);
  EXPECT_DOUBLE_EQ(loop.step(10, 1), 42);
  EXPECT_DOUBLE_EQ(loop.step(9, 1), 42 + 1 + 2);
  EXPECT_DOUBLE_EQ(loop.terms().i, 44);
}

TEST(PidLoop, DoesNotIntegrateWhileFeedbackIsOff) {
  auto loop = loopOf(1, 2, 0);
  loop.setI(5);
  loop.step(0, 1);
  EXPECT_DOUBLE_EQ(loop.terms().i, 5);
}

TEST(PidLoop, DoesNotWindUpAtALimit) {
  auto loop = loopOf(1, 1, 0);
  loop.turnOn(50);
  for (int i = 0; i < 1000; ++i) EXPECT_LE(loop.step(-90, 1), 100);
  EXPECT_LE(loop.terms().i, 100);
  for (int i = 0; i < 1000; ++i) loop.step(110, 1);
  EXPECT_GE(loop.terms().i, 0);
  EXPECT_DOUBLE_EQ(loop.terms().output, 0);
}

TEST(PidLoop, HasItsIntegralAtALimitWithoutKi) {
  auto loop = loopOf(1, 0, 0);
  loop.turnOn(50);
  loop.step(9, 1);
  EXPECT_DOUBLE_EQ(loop.terms().i, 0);
  loop.kp = -1;
  loop.step(9, 1);
  EXPECT_DOUBLE_EQ(loop.terms().i, 100);
}

}  // namespace
}  // namespace mpf::test
