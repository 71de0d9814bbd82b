// SPDX-License-Identifier: MIT
#include "shm/per_process.h"

#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/system_call.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

struct Shared {
  explicit Shared(std::string itsName = {}) : name(std::move(itsName)) {}
  std::string name;
  std::mutex mutex;
};

TEST(PerProcessTest, IsCreatedOnce) {
  PerProcess<Shared> shared;

  EXPECT_EQ(shared.get("first").name, "first");
  EXPECT_EQ(&shared.get("second"), &shared.get("third"));

  EXPECT_EQ(shared.get("fourth").name, "first");
}

TEST(PerProcessTest, ManyThreadsGetOneObject) {
  const Watchdog watchdog("per process");
  PerProcess<Shared> shared;
  std::vector<Shared*> found(8);
  std::vector<std::thread> threads;

  for (auto& place : found) threads.emplace_back([&] { place = &shared.get(); });
  for (auto& thread : threads) thread.join();

  for (const auto* each : found) EXPECT_EQ(each, &shared.get());
}

TEST(PerProcessTest, TheChildOfAForkGetsANewObject) {
  const Watchdog watchdog("per process");
  PerProcess<Shared> shared;
  const std::lock_guard lock(shared.get("parent").mutex);  // unlocked in no child

  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    auto& own = shared.get("child");
    ::_exit(own.name == "child" && own.mutex.try_lock() && &shared.get() == &own ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);

  EXPECT_EQ(status, 0);
  EXPECT_EQ(shared.get().name, "parent");
}

}  // namespace
}  // namespace mpf::test
