// SPDX-License-Identifier: MIT
// Doorbell: sleep and wake, on the futex and on the FIFO.
#include "shm/doorbell.h"

#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>

#include <thread>

#include "shm/segment_name.h"
#include "tests/shm/child.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class DoorbellTest : public ShmTest {
 protected:
  void TearDown() override {
    segments::remove(fifoName_);
    ShmTest::TearDown();
  }
  [[nodiscard]] static bool isReadable(const FileDescriptor& fifo) {
    pollfd poll{fifo.get(), POLLIN, 0};
    return ::poll(&poll, 1, 0) == 1;
  }
  layout::Word32 bell_{0};
  std::string fifoName_ = SegmentName::keyed(name(), NameKind::fifo, 1);
};

TEST_F(DoorbellTest, ARingBeforeTheSleepIsNotLost) {
  const auto seen = bell_.load(std::memory_order_relaxed);

  doorbell::ring(bell_);

  doorbell::sleep(bell_, seen, Deadline::never());
}

TEST_F(DoorbellTest, ThreadsThatWakeEachOtherLoseNoTurn) {
  constexpr int kTurns = 20'000;
  layout::Word32 bells[2]{};
  std::atomic<int> turn{0};
  const auto play = [&](int self) {
    for (int next = self; next < kTurns; next += 2) {
      for (;;) {
        const auto seen = bells[self].load(std::memory_order_relaxed);
        doorbell::fence();
        if (turn.load() == next) break;
        doorbell::sleep(bells[self], seen, Deadline::never());
      }
      turn.store(next + 1);
      doorbell::fence();
      doorbell::ring(bells[1 - self]);
    }
  };

  std::thread other(play, 1);
  play(0);
  other.join();

  EXPECT_EQ(turn, kTurns);
}

TEST_F(DoorbellTest, ASleepEndsAtItsDeadline) {
  const auto deadline = Deadline::after(5ms);

  while (!deadline.hasPassed()) doorbell::sleep(bell_, 0, deadline);
}

TEST(DeadlineTest, HasNoTimeLeftHoweverEarlyItIs) {
  EXPECT_EQ(Deadline::after(Nanoseconds::min()).left(), Nanoseconds(0));
  EXPECT_EQ(Deadline::atNs(INT64_MIN).left(), Nanoseconds(0));
}

TEST_F(DoorbellTest, APassedDeadlineDoesNotSleep) {
  doorbell::sleep(bell_, 0, Deadline::after(-1h));
  doorbell::sleep(bell_, 0, Deadline::atNs(0));
  doorbell::sleep(bell_, 0, Deadline::atNs(-1));
}

class Signals : public DoorbellTest {
 protected:
  // Calls `sleep` in a thread, and sends SIGUSR1 to that thread, which runs `handler`, until
  // `sleep` returns.
  template <class Sleep>
  static void interrupt(void (*handler)(int), int flags, Sleep sleep) {
    struct sigaction action{};
    action.sa_handler = handler;
    action.sa_flags = flags;
    struct sigaction before{};
    ::sigaction(SIGUSR1, &action, &before);
    std::atomic<bool> done{false};
    std::thread sleeper([&] {
      sleep();
      done = true;
    });
    while (!done) {
      ::pthread_kill(sleeper.native_handle(), SIGUSR1);
      std::this_thread::yield();
    }
    sleeper.join();
    ::sigaction(SIGUSR1, &before, nullptr);
  }
  static inline layout::Word32* rungBySignal = nullptr;
};

TEST_F(Signals, EndASleepIfTheHandlerIsInstalledWithoutRestart) {
  interrupt([](int) {}, 0, [&] { doorbell::sleep(bell_, 0, Deadline::never()); });
}

TEST_F(Signals, EndASleepWithADeadline) {
  interrupt([](int) {}, SA_RESTART, [&] { doorbell::sleep(bell_, 0, Deadline::after(1h)); });
}

TEST_F(Signals, EndEverySleepIfTheHandlerRings) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP()
      << "ThreadSanitizer delays signal handlers until the sleep that they must end has ended";
#endif
  rungBySignal = &bell_;

  interrupt([](int) { doorbell::ring(*rungBySignal); }, SA_RESTART,
            [&] { doorbell::sleep(bell_, 0, Deadline::never()); });
}

TEST_F(DoorbellTest, OneProcessWakesAnother) {
  auto segment = createPage();
  ASSERT_TRUE(segment.tryPublish(SegmentName::keyed(name(), NameKind::pendingBind, 1)));
  auto& bell = segment.at<layout::Word32>(1024);
  Child ringer([&](Child::Self& self) {
    // The child must open the segment again: its copies of the parent's mappings are private.
    const auto opened =
        Segment::tryOpen(SegmentName::keyed(name(), NameKind::pendingBind, 1),
                         layout::SegmentKind::pendingBind, Segment::Access::readWrite);
    self.ready();
    doorbell::ring(opened->at<layout::Word32>(1024));
    self.stay();
  });

  ringer.go();
  doorbell::sleep(bell, 0, Deadline::never());

  EXPECT_EQ(bell.load(std::memory_order_relaxed), 1u);
  segments::remove(segment.name());
}

TEST_F(DoorbellTest, AFifoIsReadableAfterARingUntilItIsDrained) {
  const auto own = doorbell::createFifo(fifoName_, 0600, ~0u);
  const auto peers = doorbell::tryOpenFifo(fifoName_);
  ASSERT_TRUE(peers);
  EXPECT_FALSE(isReadable(own));

  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(doorbell::tryRingFifo(peers));

  EXPECT_TRUE(isReadable(own));
  doorbell::drainFifo(own);
  EXPECT_FALSE(isReadable(own));
  doorbell::drainFifo(own);
}

TEST_F(DoorbellTest, RingingAFullFifoDoesNotBlock) {
  const auto own = doorbell::createFifo(fifoName_, 0600, ~0u);

  for (int i = 0; i < 100'000; ++i) EXPECT_TRUE(doorbell::tryRingFifo(own));

  EXPECT_TRUE(isReadable(own));
  doorbell::drainFifo(own);
  EXPECT_FALSE(isReadable(own));
}

TEST_F(DoorbellTest, DrainingAFifoThatIsFilledWithoutEndDoesNotBlock) {
  const FileDescriptor endless(::open("/dev/zero", O_RDONLY | O_CLOEXEC));
  ASSERT_TRUE(endless);

  doorbell::drainFifo(endless);

  EXPECT_TRUE(isReadable(endless));
}

TEST_F(DoorbellTest, AFifoHasTheRequestedModeForEveryUmask) {
  const auto before = ::umask(0777);

  const auto fifo = doorbell::createFifo(fifoName_, 0660, ::getgid());
  ::umask(before);

  struct stat status{};
  ASSERT_EQ(::stat(segments::path(fifoName_).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0660u);
  EXPECT_TRUE(S_ISFIFO(status.st_mode));
}

TEST_F(DoorbellTest, RingingTheFifoOfADeadOwnerDoesNotRaiseSigpipe) {
  Child owner([&](Child::Self& self) {
    const auto fifo = doorbell::createFifo(fifoName_, 0600, ~0u);
    self.stay();
  });
  const auto peers = doorbell::tryOpenFifo(fifoName_);
  owner.end(SIGKILL);
  Child ringer([&](Child::Self& self) {
    ::signal(SIGPIPE, SIG_DFL);
    static_cast<void>(doorbell::tryRingFifo(peers));
    segments::remove(fifoName_);
    static_cast<void>(doorbell::tryRingFifo(peers));
    self.ready();
  });

  ringer.go();

  EXPECT_EQ(ringer.end(0), 0);
}

TEST_F(DoorbellTest, AMissingFifoIsNotRung) {
  const auto none = doorbell::tryOpenFifo(fifoName_);

  EXPECT_FALSE(none);
  EXPECT_FALSE(doorbell::tryRingFifo(none));
}

}  // namespace
}  // namespace mpf::test
