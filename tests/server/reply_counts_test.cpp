// SPDX-License-Identifier: MIT
// ReplyCounts: no reply of any thread is lost.
#include "server/reply_counts.h"

#include <atomic>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

namespace mpf {
namespace {

constexpr int kThreads = 4;
constexpr int kReplies = 20'000;

std::uint64_t valueOf(const layout::Word64& word) { return word.load(std::memory_order_relaxed); }

class ReplyCountsTest : public ::testing::Test {
 protected:
  // Calls `count` kReplies times on each of kThreads threads, and on this one.
  template <class Count>
  static void onAllThreads(Count count) {
    const auto countAll = [&] {
      for (int i = 0; i < kReplies; ++i) count();
    };
    std::vector<std::jthread> threads;
    for (int i = 0; i < kThreads; ++i) threads.emplace_back(countAll);
    countAll();
  }

  layout::WindowControl control_{};
  ReplyCounts counts_{control_};
};

TEST_F(ReplyCountsTest, CountsTheRepliesOfTheServersThreadApartFromTheOthers) {
  counts_.noteServerThread();

  onAllThreads([&] { counts_.sent(2); });

  EXPECT_EQ(valueOf(control_.sent), 2u * kReplies);
  EXPECT_EQ(valueOf(control_.sentElsewhere), 2u * kReplies * kThreads);
}

TEST_F(ReplyCountsTest, TheFirstThreadThatTakesRequestsStaysTheOnlyWriter) {
  counts_.noteServerThread();
  std::jthread([&] {
    counts_.noteServerThread();
    counts_.sent();
  }).join();
  counts_.sent(2);

  EXPECT_EQ(valueOf(control_.sent), 2u);
  EXPECT_EQ(valueOf(control_.sentElsewhere), 1u);
}

TEST_F(ReplyCountsTest, CountsWhatWasNotSentOnAnyThread) {
  onAllThreads([&] {
    counts_.notSent();
    counts_.refused();
  });

  EXPECT_EQ(valueOf(control_.replyQueueFull), kReplies * (kThreads + 1u));
  EXPECT_EQ(valueOf(control_.refused), kReplies * (kThreads + 1u));
}

TEST_F(ReplyCountsTest, TimesRepliesOnAnyThread) {
  std::atomic<std::int64_t> longest{0};

  onAllThreads([&] { counts_.service(longest.fetch_add(1) + 1); });

  std::uint64_t timed = 0;
  for (const auto& bucket : control_.serviceNs.buckets) timed += valueOf(bucket);
  EXPECT_EQ(timed, kReplies * (kThreads + 1u));
  EXPECT_EQ(valueOf(control_.serviceNs.maxNs), kReplies * (kThreads + 1u));
}

}  // namespace
}  // namespace mpf
