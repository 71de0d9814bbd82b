// SPDX-License-Identifier: MIT
// CPU time of other programs while a row is measured. Other tests may run beside these and take any
// share, so the expectations are bounds that hold beside every load.
#include "benchmarks/stage/disturbance.h"

#include <gtest/gtest.h>

#include "benchmarks/stage/meter.h"
#include "benchmarks/stage/shared_object.h"

namespace mpf::bench {
namespace {

constexpr double kWorkNs = 200e6;
constexpr double kStepsNs = 30e6;  // of the idle time, on both ends

Placement onOneCpu() {
  const auto cpu = allowedCpus().front();
  return {{cpu}, {cpu}};
}

[[noreturn]] void compute() {
  pinTo(onOneCpu().server);
  for (;;) asm volatile("");
}

void waitUntilComputed(int pid, double ns) {
  while (cpuNsOf(pid) < ns) sleepFor(std::chrono::milliseconds(5));
}

double notTaken(const Disturbance& disturbance) {
  return disturbance.availableNs - disturbance.takenNs;
}

TEST(Disturbance, DoesNotCountLivingDescendants) {
  const SharedObject<std::atomic<int>> grandchild;
  const DisturbanceMeter meter(onOneCpu());
  const auto child = forkProcess([&] {
    grandchild->store(forkProcess(compute));
    for (;;) sleepFor(std::chrono::seconds(1));
  });
  while (grandchild->load() == 0) sleepFor(std::chrono::milliseconds(1));
  waitUntilComputed(grandchild->load(), kWorkNs);

  const auto disturbance = meter.read();
  killProcess(child);

  EXPECT_GE(notTaken(disturbance), kWorkNs - 1e6);
}

TEST(Disturbance, DoesNotCountDescendantsThatHaveEnded) {
  const DisturbanceMeter meter(onOneCpu());
  const auto child = forkProcess(compute);
  waitUntilComputed(child, kWorkNs);
  killProcess(child);

  EXPECT_GE(notTaken(meter.read()), kWorkNs - 1e6);
}

// The meter is in a process of its own, so that the one that computes is not its descendant.
TEST(Disturbance, CountsOtherPrograms) {
  const SharedObject<Disturbance> result;
  const SharedObject<std::atomic<bool>> isDone;
  const auto other = forkProcess(compute);
  waitUntilComputed(other, 1);
  const auto measuring = forkProcess([&] {
    const DisturbanceMeter meter(onOneCpu());
    waitUntilComputed(other, cpuNsOf(other) + kWorkNs);
    *result = meter.read();
    isDone->store(true);
  });
  while (!isDone->load()) sleepFor(std::chrono::milliseconds(1));
  killProcess(measuring);
  killProcess(other);

  EXPECT_GE(result->takenNs, kWorkNs - kStepsNs);
  EXPECT_LE(result->takenNs, result->availableNs + kStepsNs);
}

TEST(Disturbance, IsLargeAboveAShareAndAboveItsResolution) {
  const auto of = [](double takenNs, double availableNs, Mode mode = Mode::spin) {
    Disturbance disturbance;
    disturbance.takenNs = takenNs;
    disturbance.availableNs = availableNs;
    return disturbance.isLarge(mode);
  };

  EXPECT_TRUE(of(100e6, 1e9));
  EXPECT_FALSE(of(40e6, 1e9)) << "4 %";
  EXPECT_FALSE(of(20e6, 100e6)) << "not more than the steps of the idle time";
  EXPECT_FALSE(of(0, 0));
  EXPECT_FALSE(of(100e6, 1e9, Mode::block)) << "sleeps make the idle time inexact";
  EXPECT_TRUE(of(200e6, 1e9, Mode::block));
}

}  // namespace
}  // namespace mpf::bench
