// SPDX-License-Identifier: MIT
// OwnerLock: locks of strangers, which are processes that do not own the segment, neither make a
// dead owner look alive nor prevent the removal of its files.
#include "shm/owner_lock.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <semaphore>
#include <thread>
#include <vector>

#include "shm/stale_segments.h"
#include "shm/watcher.h"
#include "shm/window.h"
#include "tests/shm/child.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

using layout::SegmentKind;
using segments::Owner;
using stale_segments::Verdict;

// The lock that a stranger places on a whole file.
struct Grip {
  const char* name;
  int access;
  short type;

  friend std::ostream& operator<<(std::ostream& out, const Grip& grip) { return out << grip.name; }
};
constexpr Grip kReads{"ReadLock", O_RDONLY, F_RDLCK};
constexpr Grip kWrites{"WriteLock", O_RDWR, F_WRLCK};

class ForeignLock : public ShmTest, public testing::WithParamInterface<Grip> {
 protected:
  void TearDown() override {
    stranger_.reset();
    static_cast<void>(backplane_.removeDead());
    ShmTest::TearDown();
  }
  std::unique_ptr<Child> startOwner(SegmentKind kind) const {
    return std::make_unique<Child>([this, kind](Child::Self& self) {
      const OwnWindow window(name(), kind, kind == SegmentKind::serverWindow ? serverName() : "",
                             {}, [](layout::SegmentHeader& header) { header.name = {"server"}; });
      self.stay();
    });
  }
  // A process that waits for a lock on the file. It reports a second time that it is ready when it
  // holds the lock.
  void startStranger(const std::string& file, const Grip& grip = GetParam()) {
    stranger_ = std::make_unique<Child>([path = segments::path(file), grip](Child::Self& self) {
      const FileDescriptor opened(checkCall(::open(path.c_str(), grip.access | O_CLOEXEC), "open"));
      self.ready();
      struct flock64 lock{};
      lock.l_type = grip.type;
      lock.l_whence = SEEK_SET;
      checkCall(::fcntl(opened.get(), F_OFD_SETLKW, &lock), "lock");
      self.stay();
    });
    stranger_->go();
  }
  void killOwner(const std::unique_ptr<Child>& owner) {
    owner->end(SIGKILL);
    ASSERT_TRUE(stranger_->waitUntilReady()) << "the stranger holds the lock now";
  }
  // The only name of this kind.
  [[nodiscard]] std::string nameOf(NameKind kind) const {
    const auto names = backplane_.segmentNames();
    const auto found = std::ranges::find_if(
        names, [&](const auto& one) { return SegmentName::tryParse(one)->kind == kind; });
    return found == names.end() ? std::string() : *found;
  }
  [[nodiscard]] std::unique_ptr<OwnWindow> makeServer() const {
    return std::make_unique<OwnWindow>(name(), SegmentKind::serverWindow, serverName(), Rights{},
                                       [](layout::SegmentHeader&) {});
  }
  std::unique_ptr<Child> stranger_;
};

TEST_P(ForeignLock, OnADeadServersWindowDoesNotBlockASuccessor) {
  const auto owner = startOwner(SegmentKind::serverWindow);
  const auto old = PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow);
  startStranger(serverName());
  EXPECT_EQ(segments::probeOwner(serverName()), Owner::alive);

  killOwner(owner);

  EXPECT_FALSE(old->hasOwner());
  EXPECT_EQ(segments::probeOwner(serverName()), Owner::dead);
  const auto server = makeServer();
  EXPECT_NE(PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow)->header().incarnation,
            old->header().incarnation);
  EXPECT_EQ(nameOf(NameKind::reaper), "") << "the reaper removes its reaper file";
}

TEST_P(ForeignLock, OnAFileOfADeadProcessDoesNotPreventItsRemoval) {
  for (const auto kind : {SegmentKind::serverWindow, SegmentKind::clientWindow}) {
    for (const auto locked :
         {kind == SegmentKind::serverWindow ? NameKind::serverWindow : NameKind::clientWindow,
          NameKind::hints}) {
      const auto owner = startOwner(kind);
      startStranger(nameOf(locked));

      killOwner(owner);

      const auto judged = stale_segments::judge(name());
      EXPECT_EQ(judged.size(), 3U);
      for (const auto& file : judged)
        EXPECT_EQ(file.verdict, Verdict::dead) << file.name << ": " << file.reason;
      EXPECT_EQ(backplane_.removeDead().size(), 3U);
      EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
    }
  }
}

TEST_P(ForeignLock, OnAWindowDoesNotHideADeathFromTheWatcher) {
  const auto owner = startOwner(SegmentKind::serverWindow);
  const auto peer = PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow);
  std::binary_semaphore died{0};
  const auto token = backplane_.watcher().watchPeer(peer, [&] { died.release(); });
  startStranger(serverName());

  killOwner(owner);

  died.acquire();
  EXPECT_TRUE(peer->isDead());
  backplane_.watcher().forget(token);
}

// If the owner is in another pid namespace, only the lock is evidence. An owner never has a read
// lock.
TEST_P(ForeignLock, ForReadingIsNoEvidenceOfAnOwner) {
  if (GetParam().type != F_RDLCK) GTEST_SKIP() << "a write lock looks like the owner's there";
  const auto owner = std::make_unique<Child>([this](Child::Self& self) {
    const OwnWindow window(name(), SegmentKind::serverWindow, serverName(), {},
                           [](layout::SegmentHeader& header) { ++header.pidNamespace; });
    self.stay();
  });
  startStranger(serverName());
  EXPECT_EQ(segments::probeOwner(serverName()), Owner::alive);

  killOwner(owner);

  EXPECT_EQ(segments::probeOwner(serverName()), Owner::dead);
  EXPECT_TRUE(makeServer());
}

TEST_P(ForeignLock, OnALivingWindowDoesNotHarmItsOwner) {
  const auto server = makeServer();
  startStranger(serverName());

  EXPECT_FALSE(segments::removeIfOwnerless(serverName()));
  EXPECT_THAT(backplane_.removeDead(), testing::IsEmpty());

  EXPECT_EQ(segments::probeOwner(serverName()), Owner::alive);
}

INSTANTIATE_TEST_SUITE_P(Whole, ForeignLock, testing::Values(kReads, kWrites),
                         testing::PrintToStringParamName());

// A reaper that is killed while strangers hold locks leaves its reaper file. The next reaper uses
// this file and removes it.
TEST_F(ForeignLock, AKilledReaperDoesNotBlockTheNextReaper) {
  const auto owner = startOwner(SegmentKind::serverWindow);
  const auto incarnation =
      PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow)->header().incarnation;
  startStranger(serverName(), kReads);
  killOwner(owner);
  const auto reaperFile = SegmentName::keyed(name(), NameKind::reaper, incarnation);
  Child killed([&](Child::Self& self) {
    const FileDescriptor window(
        checkCall(::open(segments::path(serverName()).c_str(), O_RDWR | O_CLOEXEC), "open"));
    const owner_lock::Reaper reaper(window, reaperFile);
    if (!reaper.mayRemove()) ::_exit(4);
    self.stay();
  });
  EXPECT_FALSE(segments::removeIfOwnerless(serverName())) << "another reaper is removing it";
  EXPECT_FALSE(owner_lock::removeReaperFile(reaperFile));

  killed.end(SIGKILL);

  EXPECT_EQ(nameOf(NameKind::reaper), reaperFile);
  EXPECT_TRUE(segments::removeIfOwnerless(serverName()));
  EXPECT_EQ(nameOf(NameKind::reaper), "");
}

// Each reaper stays until all have tried. If all gave up, the name would stay.
TEST_F(ForeignLock, OfReapersThatTryAtOnceOneGetsTheRight) {
  constexpr int kReapers = 3;
  constexpr int kRounds = 3000;
  auto window = createPage(SegmentKind::serverWindow);
  ASSERT_TRUE(window.tryPublish(serverName()));
  const auto reaperFile = SegmentName::keyed(name(), NameKind::reaper, 7);
  std::vector<int> granted(kRounds, 0);
  std::barrier together(kReapers);
  const auto reap = [&] {
    for (auto& count : granted) {
      const FileDescriptor opened(::open(segments::path(serverName()).c_str(), O_RDWR | O_CLOEXEC));
      together.arrive_and_wait();
      const owner_lock::Reaper reaper(opened, reaperFile);
      if (reaper.mayRemove()) ++std::atomic_ref(count);
      together.arrive_and_wait();
    }
  };

  {
    std::vector<std::jthread> reapers;
    for (int i = 0; i < kReapers; ++i) reapers.emplace_back(reap);
  }

  EXPECT_THAT(granted, testing::Each(1));
  EXPECT_EQ(nameOf(NameKind::reaper), "");
}

TEST_F(ForeignLock, RemovalOfStaleFilesIncludesReaperFiles) {
  const auto reaperFile = SegmentName::keyed(name(), NameKind::reaper, 7);
  const FileDescriptor made(checkCall(
      ::open(segments::path(reaperFile).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600), "create"));

  EXPECT_THAT(backplane_.removeDead(), testing::ElementsAre(reaperFile));
}

// Another user may create a file that looks like a dead window and has the incarnation of hints
// whose owner is alive.
TEST_F(ForeignLock, AWindowOfAnotherUserIsNoEvidenceAboutHints) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can act as two users";
  const OwnWindow client(name(), SegmentKind::clientWindow, "", {}, [](layout::SegmentHeader&) {});
  auto fake = Segment::create(layout::kWindowBytes, SegmentKind::serverWindow, name(),
                              {.mode = 0644, .user = 65534});
  fake.sharedHeader().incarnation = client.header().incarnation;
  ASSERT_TRUE(fake.tryPublish(serverName("fake")));
  fake = {};

  EXPECT_THAT(backplane_.removeDead(), testing::ElementsAre(serverName("fake")));

  EXPECT_EQ(backplane_.segmentNames().size(), 3U);
}

// The start time distinguishes the owner from a later process with the same pid. The header in this
// test names a process that started when the host booted.
TEST_F(ForeignLock, AHeaderThatNamesNoLivingProcessProvesDeath) {
  const OwnWindow window(name(), SegmentKind::serverWindow, serverName(), {},
                         [](layout::SegmentHeader& header) { header.ownerStartTicks = 1; });

  EXPECT_EQ(segments::probeOwner(serverName()), Owner::dead);
}

}  // namespace
}  // namespace mpf::test
