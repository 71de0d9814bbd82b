// SPDX-License-Identifier: MIT
#include "drivers/gpib/bus_turns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

class BusTurnsTest : public testing::Test {
 protected:
  static Deadline later() { return Deadline::after(60s); }
  static Deadline now() { return Deadline::after(0s); }
  // Takes a turn in a thread of its own, notes its user, and gives the turn back.
  void takeBeside(GpibUser user) {
    threads_.emplace_back([this, user] {
      ASSERT_TRUE(turns_.take(user, later()).ok());
      order_.push_back(user);
      turns_.give();
    });
    while (turns_.waiting() < threads_.size()) std::this_thread::yield();
  }
  void join() {
    for (auto& thread : threads_) thread.join();
  }

  Watchdog watchdog_{"bus turns test"};
  BusTurns turns_;
  std::vector<std::thread> threads_;
  std::vector<GpibUser> order_;  // the thread that has the turn
};

TEST_F(BusTurnsTest, IsFirstComeFirstServed) {
  ASSERT_TRUE(turns_.take(0, now()).ok());
  for (const GpibUser user : {3u, 1u, 2u}) takeBeside(user);

  turns_.give();

  join();
  EXPECT_THAT(order_, ElementsAre(3, 1, 2));
}

TEST_F(BusTurnsTest, ACallerGivesUpAtItsDeadlineAndLosesItsPlace) {
  ASSERT_TRUE(turns_.take(0, now()).ok());

  const auto late = turns_.take(1, Deadline::after(5ms));

  EXPECT_EQ(late.status, GpibStatus::timeout);
  EXPECT_THAT(late.reason, HasSubstr("busy"));
  EXPECT_EQ(turns_.waiting(), 0U);
  turns_.give();
  EXPECT_TRUE(turns_.take(2, now()).ok());
}

TEST_F(BusTurnsTest, OnlyTheHolderPassesALease) {
  ASSERT_TRUE(turns_.lease(7, "scan", 60s, now()).ok());

  EXPECT_TRUE(turns_.take(7, now()).ok());
  turns_.give();
  const auto other = turns_.take(8, Deadline::after(5ms));

  EXPECT_EQ(other.status, GpibStatus::leased);
  EXPECT_THAT(other.reason, HasSubstr("\"scan\""));
  EXPECT_EQ(turns_.take(0, now()).status, GpibStatus::leased);
  EXPECT_EQ(turns_.lease(8, "other", 60s, now()).status, GpibStatus::leased);
}

TEST_F(BusTurnsTest, TheBusItselfPassesALease) {
  ASSERT_TRUE(turns_.lease(7, "scan", 60s, now()).ok());

  EXPECT_TRUE(turns_.take(BusTurns::kBusItself, now()).ok());
}

TEST_F(BusTurnsTest, OthersKeepTheirPlacesDuringALease) {
  ASSERT_TRUE(turns_.lease(7, "scan", 60s, now()).ok());
  takeBeside(2);
  takeBeside(1);

  ASSERT_TRUE(turns_.take(7, now()).ok());
  turns_.give();
  EXPECT_THAT(order_, ElementsAre());
  turns_.release(7);

  join();
  EXPECT_THAT(order_, ElementsAre(2, 1));
}

TEST_F(BusTurnsTest, AnOperationOfTheHolderEndsBeforeOthersBegin) {
  ASSERT_TRUE(turns_.lease(7, "scan", 60s, now()).ok());
  ASSERT_TRUE(turns_.take(7, now()).ok());

  turns_.release(7);

  EXPECT_FALSE(turns_.holder());
  EXPECT_EQ(turns_.take(8, now()).status, GpibStatus::timeout);
  turns_.give();
  EXPECT_TRUE(turns_.take(8, now()).ok());
}

TEST_F(BusTurnsTest, ALeaseEndsAtItsLimit) {
  ASSERT_TRUE(turns_.lease(7, "scan", 20ms, now()).ok());

  ASSERT_TRUE(turns_.take(8, later()).ok());

  EXPECT_FALSE(turns_.holder());
}

// Its waiters began to wait when there was no lease, so they did not have its end in view.
TEST_F(BusTurnsTest, ALeaseThatBeginsDuringAWaitEndsAtItsLimit) {
  ASSERT_TRUE(turns_.take(0, now()).ok());
  std::thread leaser([&] { EXPECT_TRUE(turns_.lease(7, "scan", 20ms, later()).ok()); });
  while (turns_.waiting() < 1) std::this_thread::yield();
  threads_.emplace_back([&] {
    EXPECT_TRUE(turns_.take(8, Deadline::never()).ok());
    turns_.give();
  });
  while (turns_.waiting() < 2) std::this_thread::yield();

  turns_.give();

  leaser.join();
  join();
}

TEST_F(BusTurnsTest, TheHolderIsVisibleAndExtendsItsLease) {
  const auto before = Clock::nowNs();
  ASSERT_TRUE(turns_.lease(7, "scan", 1min, now()).ok());
  ASSERT_TRUE(turns_.lease(7, "long scan", 2min, now()).ok());

  const auto holder = turns_.holder();

  ASSERT_TRUE(holder);
  EXPECT_EQ(holder->user, 7U);
  EXPECT_EQ(holder->name, "long scan");
  EXPECT_GE(holder->sinceNs, before);
  EXPECT_GT(holder->until, Deadline::after(1min));
}

TEST_F(BusTurnsTest, OnlyTheHolderReleases) {
  ASSERT_TRUE(turns_.lease(7, "scan", 60s, now()).ok());

  turns_.release(8);

  EXPECT_TRUE(turns_.holder());
}

TEST_F(BusTurnsTest, NobodysIdCannotLease) {
  EXPECT_EQ(turns_.lease(0, "nobody", 60s, now()).status, GpibStatus::failure);
  EXPECT_FALSE(turns_.holder());
}

}  // namespace
}  // namespace mpf::test
