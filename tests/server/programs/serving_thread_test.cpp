// SPDX-License-Identifier: MIT
#include "server/programs/serving_thread.h"

#include <gtest/gtest.h>
#include <semaphore>
#include <stdexcept>

#include "base/stop_signals.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

class ServingThreadTest : public testing::Test {
 protected:
  Watchdog watchdog_{"serving thread test"};
  ServerLog log_{"test", "off"};
};

TEST_F(ServingThreadTest, ReportsAnException) {
  std::binary_semaphore failed(0);
  ServingThread thread;

  thread.start(log_, [] { throw std::runtime_error("no memory"); }, [&] { failed.release(); });

  failed.acquire();
  thread.join();
}

TEST_F(ServingThreadTest, EndsSilentlyWhenStopped) {
  std::binary_semaphore stop(0);
  ServingThread thread;
  thread.start(log_, [&] { stop.acquire(); }, [] { FAIL() << "nothing failed"; });

  stop.release();
  thread.join();
}

TEST_F(ServingThreadTest, MayBeDestroyedUnstarted) {
  ServingThread thread;
  thread.join();
}

TEST_F(ServingThreadTest, AFailureEndsTheProgramAsASignalDoes) {
  std::binary_semaphore told(0);
  const StopSignals signals(
      [](void* semaphore) noexcept { static_cast<std::binary_semaphore*>(semaphore)->release(); },
      &told);
  ProgramFailure failure;
  EXPECT_EQ(failure.exitStatus(), 0);
  ServingThread thread;

  thread.start(log_, [] { throw std::runtime_error("no memory"); }, [&] { failure.report(); });

  told.acquire();
  EXPECT_EQ(failure.exitStatus(), 1);
}

}  // namespace
}  // namespace mpf::test
