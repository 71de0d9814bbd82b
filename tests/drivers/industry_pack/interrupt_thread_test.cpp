// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/interrupt_thread.h>

#include <sched.h>

#include <atomic>
#include <gtest/gtest.h>
#include <semaphore>
#include <thread>

#include "plain_model.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class InterruptThreadTest : public testing::Test {
 protected:
  InterruptThreadTest() { carrier_.plug("IP_a", std::make_unique<PlainModel>()); }
  Registers& io() { return carrier_.site(0).io(); }
  // The handler of a chip whose bit 0 of word 0 is its request.
  InterruptThread::Handler serve() {
    return [this](InterruptThread::Cause) {
      const bool asks = io().read16(0) != 0;
      if (asks) io().write16(0, 0);
      if (asks) served_.release();
      return asks;
    };
  }
  Watchdog watchdog_{"interrupt thread test"};
  ModelCarrier carrier_;
  std::counting_semaphore<> served_{0};
};

TEST_F(InterruptThreadTest, ServesEachInterrupt) {
  InterruptThread thread(carrier_.site(0).interrupt(0), {}, serve());
  for (int i = 0; i < 100; ++i) {
    io().write16(0, 1);
    served_.acquire();
  }
  EXPECT_EQ(thread.counters().storms, 0u);
}

TEST_F(InterruptThreadTest, ServesAnInterruptThatIsPendingAtTheStart) {
  io().write16(0, 1);
  InterruptThread thread(carrier_.site(0).interrupt(0), {}, serve());
  served_.acquire();
}

TEST_F(InterruptThreadTest, HasThePriorityOfItsInterruptWherePermitted) {
  for (const int priority : {kInterruptPriority, 0}) {
    const bool mayHave = priority > 0 && RealTimePriority::isAllowed(priority);
    std::atomic<int> policy{-1};
    carrier_.site(0).interrupt(0).setPriority(priority);
    InterruptThread thread(carrier_.site(0).interrupt(0), {}, [&](InterruptThread::Cause) {
      policy = ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
      return true;
    });

    thread.wake();

    while (policy == -1) std::this_thread::yield();
    EXPECT_EQ(policy, mayHave ? SCHED_FIFO : SCHED_OTHER);
  }
}

// The handler always finds a request, so no storm pauses it; a thread that it waits for may need
// the same processor.
TEST_F(InterruptThreadTest, LosesItsPriorityWhenItNeverSleeps) {
  std::atomic<bool> isOrdinary{false};
  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  InterruptThread thread(carrier_.site(0).interrupt(0), {}, [&](InterruptThread::Cause) {
    if ((::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) == SCHED_OTHER) isOrdinary = true;
    return true;
  });

  while (!isOrdinary) std::this_thread::yield();
}

TEST_F(InterruptThreadTest, FindsLostInterruptsByPolling) {
  carrier_.setFault("IP_a", ModelFault::interruptsLost);
  InterruptThread thread(carrier_.site(0).interrupt(0), {.pollEvery = 1ms}, serve());
  io().write16(0, 1);
  served_.acquire();
  while (thread.counters().late == 0) std::this_thread::yield();
  EXPECT_EQ(thread.counters().interrupts, 0u);
}

TEST_F(InterruptThreadTest, MasksAStormAndStillPolls) {
  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  InterruptThread thread(carrier_.site(0).interrupt(0),
                         {.pollEvery = 1ms, .stormLimit = 10, .stormPause = 1h}, serve());
  while (thread.counters().storms == 0) std::this_thread::yield();
  const auto interrupts = thread.counters().interrupts;
  io().write16(0, 1);
  served_.acquire();
  EXPECT_EQ(interrupts, 10u);
  EXPECT_EQ(thread.counters().interrupts, 10u);
}

// One interrupt of four has a request, as on a stuck line while the chip is busy.
TEST_F(InterruptThreadTest, MasksAStormDespiteTraffic) {
  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  std::counting_semaphore<> storms{0};
  InterruptThread thread(
      carrier_.site(0).interrupt(0), {.stormLimit = 100, .stormPause = 1h},
      [i = 0](InterruptThread::Cause) mutable { return ++i % 4 == 0; },
      [&](InterruptFault fault) {
        EXPECT_EQ(fault, InterruptFault::storm);
        storms.release();
      });

  storms.acquire();

  EXPECT_EQ(thread.counters().storms, 1u);
}

TEST_F(InterruptThreadTest, ToleratesSpuriousInterruptsAmongInterruptsWithARequest) {
  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  InterruptThread thread(carrier_.site(0).interrupt(0), {.stormLimit = 100, .stormPause = 1h},
                         [i = 0](InterruptThread::Cause) mutable { return ++i % 3 == 0; });
  while (thread.counters().spurious < 5000) std::this_thread::yield();
  EXPECT_EQ(thread.counters().storms, 0u);
}

TEST_F(InterruptThreadTest, ReportsAStormWhenItBeginsAndNotAfterEachPause) {
  std::atomic<int> told = 0;
  InterruptThread thread(carrier_.site(0).interrupt(0), {.stormLimit = 10, .stormPause = 10ms},
                         serve(), [&](InterruptFault) { ++told; });

  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  while (thread.counters().storms < 10) std::this_thread::yield();

  EXPECT_EQ(told, 1);
  EXPECT_TRUE(thread.isStorming());
}

TEST_F(InterruptThreadTest, AStormEndsWhenTheLineIsReleasedAndTheNextOneIsReportedAgain) {
  std::counting_semaphore<> storms{0};
  InterruptThread thread(carrier_.site(0).interrupt(0), {.stormLimit = 10, .stormPause = 1ms},
                         serve(), [&](InterruptFault fault) {
                           EXPECT_EQ(fault, InterruptFault::storm);
                           storms.release();
                         });
  EXPECT_FALSE(thread.isStorming());
  for (int i = 0; i < 3; ++i) {
    carrier_.setFault("IP_a", ModelFault::interruptStorm);
    storms.acquire();
    EXPECT_TRUE(thread.isStorming());
    carrier_.setFault("IP_a", ModelFault::none);
    while (thread.isStorming()) std::this_thread::yield();
  }
}

TEST_F(InterruptThreadTest, AStormLastsAsLongAsItsPause) {
  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  InterruptThread thread(carrier_.site(0).interrupt(0),
                         {.pollEvery = 1ms, .stormLimit = 10, .stormPause = 1h}, serve());
  while (thread.counters().storms == 0) std::this_thread::yield();
  carrier_.setFault("IP_a", ModelFault::none);
  io().write16(0, 1);
  served_.acquire();
  EXPECT_TRUE(thread.isStorming());
}

TEST_F(InterruptThreadTest, ReportsADeadLineOnce) {
  std::atomic<int> told = 0;
  InterruptThread thread(carrier_.site(0).interrupt(0), {.pollEvery = 1ms, .lateLimit = 3}, serve(),
                         [&](InterruptFault fault) {
                           EXPECT_EQ(fault, InterruptFault::dead);
                           ++told;
                         });
  carrier_.setFault("IP_a", ModelFault::interruptsLost);
  for (int i = 0; i < 10; ++i) {
    io().write16(0, 1);
    served_.acquire();
  }
  while (thread.counters().late < 10) std::this_thread::yield();
  EXPECT_EQ(told, 1);
}

TEST_F(InterruptThreadTest, DoesNotReportALineAsDeadThatItHasMasked) {
  std::atomic<int> dead = 0;
  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  InterruptThread thread(
      carrier_.site(0).interrupt(0),
      {.pollEvery = 1ms, .stormLimit = 10, .stormPause = 1h, .lateLimit = 3}, serve(),
      [&](InterruptFault fault) { dead += fault == InterruptFault::dead ? 1 : 0; });
  while (thread.counters().storms == 0) std::this_thread::yield();
  for (int i = 0; i < 10; ++i) {
    io().write16(0, 1);
    served_.acquire();
  }
  EXPECT_EQ(dead, 0);
}

TEST_F(InterruptThreadTest, ServesInterruptsAgainAfterAStorm) {
  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  InterruptThread thread(carrier_.site(0).interrupt(0), {.stormLimit = 10, .stormPause = 1ms},
                         serve());
  while (thread.counters().storms < 3) std::this_thread::yield();
  carrier_.setFault("IP_a", ModelFault::none);
  io().write16(0, 1);
  served_.acquire();
}

TEST_F(InterruptThreadTest, RunsItsHandlerWhenWoken) {
  std::counting_semaphore<> ran{0};
  InterruptThread thread(carrier_.site(0).interrupt(0), {}, [&](InterruptThread::Cause cause) {
    if (cause == InterruptThread::Cause::poll) ran.release();
    return false;
  });
  thread.wake();
  ran.acquire();
}

}  // namespace
}  // namespace mpf::test
