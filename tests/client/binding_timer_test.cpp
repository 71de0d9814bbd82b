// SPDX-License-Identifier: MIT
// BindingTimer and the DispatcherTimer that it lowers.
#include "client/binding_timer.h"

#include <algorithm>
#include <atomic>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "tests/support/test_backplane.h"

namespace mpf::test {
namespace {

class BindingTimerTest : public testing::Test {
 protected:
  // Calls `work` while the dispatcher waits in another thread. Returns whether that wakes it.
  template <class Work>
  bool wakes(const Work& work) {
    std::thread([this] { dispatcher_.setWaitingThread(); }).join();
    static_cast<void>(endpoint_.takeLocalEvent());
    work();
    return endpoint_.takeLocalEvent();
  }

  TestBackplane backplane_;
  Endpoint endpoint_{backplane_,      layout::SegmentKind::clientWindow,
                     std::string(),   Rights{.mode = 0600},
                     WaitMode::block, [](layout::SegmentHeader&) {}};
  DispatcherTimer dispatcher_{endpoint_};
  BindingTimer first_{dispatcher_};
  BindingTimer second_{dispatcher_};
};

TEST_F(BindingTimerTest, NothingIsDueAtFirst) {
  EXPECT_EQ(first_.dueNs(), INT64_MAX);
  EXPECT_TRUE(dispatcher_.due().isNever());
  EXPECT_FALSE(dispatcher_.isDue());
}

TEST_F(BindingTimerTest, TheEarliestTimeCounts) {
  first_.wakeAt(300);
  second_.wakeAt(200);
  first_.wakeAt(400);

  EXPECT_EQ(first_.dueNs(), 300);
  EXPECT_EQ(second_.dueNs(), 200);
  EXPECT_EQ(dispatcher_.due().ns(), 200);
  EXPECT_TRUE(dispatcher_.isDue());
}

TEST_F(BindingTimerTest, AnEarlierTimeWakesADispatcherThatWaitsInAnotherThread) {
  EXPECT_TRUE(wakes([&] { first_.wakeAt(300); }));
  EXPECT_FALSE(wakes([&] { second_.wakeAt(400); }));
  EXPECT_TRUE(wakes([&] { second_.wakeAt(200); }));
}

TEST_F(BindingTimerTest, TheThreadThatWaitsDoesNotWakeItself) {
  dispatcher_.setWaitingThread();
  static_cast<void>(endpoint_.takeLocalEvent());

  first_.wakeAt(300);

  EXPECT_FALSE(endpoint_.takeLocalEvent());
}

TEST_F(BindingTimerTest, ALoweredTimeIsReportedOnceUntilItIsRead) {
  auto* const owner = reinterpret_cast<Binding*>(&first_);  // never dereferenced
  BindingTimer timer(dispatcher_, owner);
  EXPECT_THAT(*dispatcher_.takeLowered(), testing::IsEmpty());

  timer.wakeAt(300);
  timer.wakeAt(200);

  EXPECT_THAT(*dispatcher_.takeLowered(), testing::ElementsAre(owner));
  timer.wakeAt(150);
  EXPECT_THAT(*dispatcher_.takeLowered(), testing::IsEmpty()) << "the time was not read yet";
  EXPECT_EQ(timer.takeReported(), 150);
  timer.wakeAt(160);
  EXPECT_THAT(*dispatcher_.takeLowered(), testing::IsEmpty()) << "not lowered";
  timer.wakeAt(100);
  EXPECT_THAT(*dispatcher_.takeLowered(), testing::ElementsAre(owner));
}

// The thread that reports may be slower than another one that lowers the time further and relies on
// the report.
TEST_F(BindingTimerTest, NoTimeIsLostWhileAnotherThreadReports) {
  constexpr int kRounds = 2000;
  constexpr std::int64_t kNowNs = 750;
  auto* const owner = reinterpret_cast<Binding*>(&first_);  // never dereferenced
  BindingTimer timer(dispatcher_, owner);
  std::int64_t scheduledNs = INT64_MAX;
  const auto handleDue = [&] {
    if (dispatcher_.due().ns() > kNowNs) return;
    dispatcher_.reset();
    const auto lowered = *dispatcher_.takeLowered();
    if (std::ranges::find(lowered, owner) != lowered.end()) scheduledNs = timer.takeReported();
  };
  std::atomic<int> round{0};
  std::atomic<int> done{0};
  const auto lowerInEachRound = [&](std::int64_t ns) {
    for (int next = 1; next <= kRounds; ++next) {
      while (round.load() != next) std::this_thread::yield();
      timer.wakeAt(ns);
      ++done;
    }
  };
  std::thread others([&] {  // a report has to wait for theirs
    while (round.load() != kRounds) dispatcher_.reportLowered(nullptr);
  });
  std::thread later(lowerInEachRound, 1000);
  std::thread earlier(lowerInEachRound, 500);
  int lost = 0;
  while (round.load() != kRounds) {
    timer.reset();
    dispatcher_.reset();
    static_cast<void>(dispatcher_.takeLowered());
    static_cast<void>(timer.takeReported());
    scheduledNs = INT64_MAX;
    done = 0;
    ++round;
    while (done.load() != 2) {
      handleDue();
      std::this_thread::yield();
    }
    handleDue();
    if (scheduledNs != 500) ++lost;
  }
  others.join();
  later.join();
  earlier.join();

  EXPECT_EQ(lost, 0);
}

TEST_F(BindingTimerTest, AResetForgetsTheTime) {
  first_.wakeAt(300);

  dispatcher_.reset();
  EXPECT_TRUE(dispatcher_.due().isNever());
  EXPECT_EQ(first_.dueNs(), 300);
  first_.reset();

  EXPECT_EQ(first_.dueNs(), INT64_MAX);
}

}  // namespace
}  // namespace mpf::test
