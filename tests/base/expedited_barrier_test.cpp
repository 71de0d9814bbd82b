// SPDX-License-Identifier: MIT
#include "base/expedited_barrier.h"

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <gtest/gtest.h>
#include <thread>

namespace mpf {
namespace {

class ExpeditedBarrierTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!expedited_barrier::tryRegister()) GTEST_SKIP() << "no membarrier() here";
  }
};

// Waits until both threads are here. Polls, so that they leave at nearly the same time, and yields
// when the other thread needs this processor.
class Meeting {
 public:
  void wait(int round) noexcept {
    arrived_.fetch_add(1);
    for (int polls = 0; arrived_.load() < 2 * round; ++polls) {
      if (polls % 10'000 == 9'999) std::this_thread::yield();
    }
  }

 private:
  std::atomic<int> arrived_{0};
};

// Each side stores its own word and then loads the other one. Without the barrier, both loads miss
// the other's store in some of the rounds, if there are two processors.
TEST_F(ExpeditedBarrierTest, AtLeastOneSideSeesTheOtherOne) {
  constexpr int kRounds = 50'000;
  struct alignas(64) Word {
    std::atomic<int> value{0};
  };
  Word frequent, rare, seen;
  Meeting begin, end;
  std::thread other([&] {
    for (int round = 1; round <= kRounds; ++round) {
      begin.wait(round);
      frequent.value.store(round, std::memory_order_relaxed);
      expedited_barrier::frequentSide();
      seen.value.store(rare.value.load(std::memory_order_relaxed), std::memory_order_relaxed);
      end.wait(round);
    }
  });
  int missed = 0;
  for (int round = 1; round <= kRounds; ++round) {
    begin.wait(round);
    rare.value.store(round, std::memory_order_relaxed);
    expedited_barrier::inThisProcess();
    const auto seenHere = frequent.value.load(std::memory_order_relaxed);
    end.wait(round);
    if (seenHere < round && seen.value.load() < round) ++missed;
  }
  other.join();

  EXPECT_EQ(missed, 0);
}

TEST_F(ExpeditedBarrierTest, AChildOfAForkHasBothKinds) {
  const auto child = ::fork();
  if (child == 0) {
    expedited_barrier::inThisProcess();
    expedited_barrier::acrossProcesses();
    ::_exit(expedited_barrier::tryRegister() ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);

  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace mpf
