// SPDX-License-Identifier: MIT
#include <mpf/classic/vxworks.h>

#include <gtest/gtest.h>
#include <thread>

#include <mpf/clock.h>

namespace mpf::test {
namespace {

struct Device {
  SEM_ID done = semBCreate(SEM_Q_FIFO, SEM_EMPTY);
  int sum = 0;

  static int task(Device* self, std::intptr_t two, std::intptr_t three) {
    self->sum = static_cast<int>(two + three);
    return semGive(self->done);
  }
  int start(const char* name) {
    // NOLINTNEXTLINE: an old source
    return taskSpawn(name, 100, VX_FP_TASK, 2000, reinterpret_cast<FUNCPTR>(&task), (int)this, 2,
                     (int)3, 0, 0, 0, 0, 0, 0, 0);
  }
  ~Device() { semDelete(done); }
};

TEST(VxWorks, ATaskGetsAPointerThatWasCastToInt) {
  Device device;

  EXPECT_NE(device.start("device"), ERROR);

  EXPECT_EQ(semTake(device.done, WAIT_FOREVER), OK);
  EXPECT_EQ(device.sum, 5);
}

TEST(VxWorks, ATaskMayHaveNoName) {
  Device device;

  EXPECT_NE(device.start(nullptr), ERROR);

  EXPECT_EQ(semTake(device.done, WAIT_FOREVER), OK);
}

TEST(VxWorks, ABinarySemaphoreIsTakenOnce) {
  const auto semaphore = semBCreate(SEM_Q_FIFO, SEM_FULL);

  EXPECT_EQ(semTake(semaphore, NO_WAIT), OK);
  EXPECT_EQ(semTake(semaphore, NO_WAIT), ERROR);
  EXPECT_EQ(semTake(semaphore, 1), ERROR);
  EXPECT_EQ(semGive(semaphore), OK);
  EXPECT_EQ(semTake(semaphore, 1), OK);
  EXPECT_EQ(semDelete(semaphore), OK);
}

TEST(VxWorks, AMutexBelongsToTheThreadThatHasTakenIt) {
  const auto mutex = semMCreate(SEM_Q_PRIORITY);
  EXPECT_EQ(semTake(mutex, WAIT_FOREVER), OK);
  EXPECT_EQ(semTake(mutex, NO_WAIT), OK);

  std::thread([mutex] {
    EXPECT_EQ(semTake(mutex, NO_WAIT), ERROR);
    EXPECT_EQ(semGive(mutex), ERROR);
  }).join();
  EXPECT_EQ(semGive(mutex), OK);
  std::thread([mutex] { EXPECT_EQ(semTake(mutex, NO_WAIT), ERROR); }).join();
  EXPECT_EQ(semGive(mutex), OK);
  std::thread([mutex] {
    EXPECT_EQ(semTake(mutex, NO_WAIT), OK);
    EXPECT_EQ(semGive(mutex), OK);
  }).join();

  EXPECT_EQ(semGive(mutex), ERROR);
  semDelete(mutex);
}

TEST(VxWorks, ADelayLastsItsTicks) {
  const auto before = Clock::nowNs();
  const auto ticks = tickGet();

  EXPECT_EQ(taskDelay(sysClkRateGet() / 10), OK);

  EXPECT_GE(Clock::nowNs() - before, 100'000'000);
  EXPECT_GE(tickGet(), ticks + 6);
}

}  // namespace
}  // namespace mpf::test
