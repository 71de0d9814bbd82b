// SPDX-License-Identifier: MIT
// Segment: one file in /dev/shm: created, locked, named, mapped, removed.
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <bit>
#include <cstring>
#include <set>
#include <thread>

#include <mpf/clock.h>

#include "tests/shm/child.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

using layout::SegmentKind;
using Access = Segment::Access;

class SegmentTest : public ShmTest {
 protected:
  void TearDown() override {
    segments::remove(file_);
    ShmTest::TearDown();
  }
  [[nodiscard]] struct stat status() const {
    struct stat found{};
    EXPECT_EQ(::stat(segments::path(file_).c_str(), &found), 0);
    return found;
  }
  std::string file_ = SegmentName::keyed(name(), NameKind::pendingBind, 1);
};

TEST_F(SegmentTest, IsZeroedAndItsHeaderNamesItsCreatorTimeAndKind) {
  const auto before = Clock::nowNs();

  const auto segment = createPage(SegmentKind::bulk);

  const auto& header = segment.header();
  EXPECT_EQ(std::memcmp(&header.magic,
                        std::endian::native == std::endian::little ? "MPF-WIN1" : "1NIW-FPM", 8),
            0);
  EXPECT_EQ(header.layoutMajor, layout::kMajor);
  EXPECT_EQ(header.layoutMinor, layout::kMinor);
  EXPECT_EQ(header.kind, SegmentKind::bulk);
  EXPECT_EQ(header.totalBytes, layout::kPageBytes);
  EXPECT_NE(header.incarnation, 0u);
  EXPECT_EQ(header.ownerWindow, header.incarnation);
  EXPECT_EQ(header.ownerPid, ::getpid());
  EXPECT_EQ(header.ownerUid, ::getuid());
  EXPECT_GT(header.ownerStartTicks, 0u);
  EXPECT_GE(header.createdMonotonicNs, before);
  EXPECT_LE(header.createdMonotonicNs, Clock::nowNs());
  EXPECT_EQ(header.backplane.data(), name());
  EXPECT_STREQ(header.program.data(), "shm_test");
  EXPECT_EQ(segment.bytes(), layout::kPageBytes);
  EXPECT_TRUE(std::all_of(segment.data() + layout::kHeaderBytes, segment.data() + segment.bytes(),
                          [](std::byte byte) { return byte == std::byte{0}; }));
}

TEST_F(SegmentTest, HasItsNameOnlyAfterItIsPublished) {
  auto segment = createPage();
  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
  segment.sharedHeader().location = 7;

  ASSERT_TRUE(segment.tryPublish(file_));

  EXPECT_THAT(backplane_.segmentNames(), testing::ElementsAre(file_));
  EXPECT_EQ(Segment::tryOpen(file_, SegmentKind::pendingBind, Access::readOnly)->header().location,
            7);
}

TEST_F(SegmentTest, IsCompleteAndLockedAsSoonAsItHasItsName) {
  std::atomic<int> seen{0};
  std::thread maker([&] {
    while (seen < 500) {
      auto segment = createPage();
      segment.lockForLife();
      segment.sharedHeader().location = 7;
      EXPECT_TRUE(segment.tryPublish(file_));
      segments::remove(file_);
    }
  });

  while (seen < 500) {
    const auto segment = Segment::tryOpen(file_, SegmentKind::pendingBind, Access::readOnly);
    if (!segment) continue;
    ++seen;
    EXPECT_EQ(segment->header().location, 7);
    EXPECT_EQ(segment->bytes(), layout::kPageBytes);
    // The creator removes the name before it releases the lock.
    EXPECT_TRUE(segment->hasOwner() || segments::probeOwner(file_, segment->header().incarnation) ==
                                           segments::Owner::absent);
  }
  maker.join();
}

TEST_F(SegmentTest, ACreatorKilledBeforePublishingLeavesNothing) {
  Child child([&](Child::Self& self) {
    auto segment = createPage();
    segment.lockForLife();
    self.stay();
  });

  child.end(SIGKILL);

  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
}

TEST_F(SegmentTest, DoesNotPublishASecondSegmentOfTheSameName) {
  auto first = createPage();
  auto second = createPage();
  ASSERT_TRUE(first.tryPublish(file_));

  EXPECT_FALSE(second.tryPublish(file_));

  EXPECT_EQ(
      Segment::tryOpen(file_, SegmentKind::pendingBind, Access::readOnly)->header().incarnation,
      first.header().incarnation);
}

TEST_F(SegmentTest, OneOfManyCreatorsGetsTheName) {
  for (int round = 0; round < 200; ++round) {
    std::atomic<int> wins{0};
    std::vector<std::thread> creators;
    for (int i = 0; i < 4; ++i) {
      creators.emplace_back([&] {
        auto segment = createPage();
        if (segment.tryPublish(file_)) ++wins;
      });
    }
    for (auto& creator : creators) creator.join();

    ASSERT_EQ(wins, 1);
    ASSERT_TRUE(segments::remove(file_));
  }
}

TEST_F(SegmentTest, ProcessesShareItsContents) {
  auto segment = createPage();
  ASSERT_TRUE(segment.tryPublish(file_));
  auto opened = Segment::tryOpen(file_, SegmentKind::pendingBind, Access::readWrite);
  ASSERT_TRUE(opened);
  opened->closeFile();

  opened->at<std::uint32_t>(1000) = 7;

  EXPECT_EQ(segment.at<std::uint32_t>(1000), 7u);
}

TEST_F(SegmentTest, DoesNotOpenAnUnusedName) {
  EXPECT_FALSE(Segment::tryOpen(file_, SegmentKind::pendingBind, Access::readOnly));
  EXPECT_FALSE(segments::remove(file_));
  EXPECT_FALSE(segments::removeIfOwnerless(file_));
  EXPECT_EQ(segments::probeOwner(file_), segments::Owner::absent);
}

TEST_F(SegmentTest, HasAnOwnerOnlyWhileItIsLocked) {
  auto segment = createPage();
  segment.lockForLife();
  ASSERT_TRUE(segment.tryPublish(file_));
  const auto peers = Segment::tryOpen(file_, SegmentKind::pendingBind, Access::readOnly);
  EXPECT_TRUE(peers->hasOwner());
  EXPECT_EQ(segments::probeOwner(file_), segments::Owner::alive);

  const auto incarnation = segment.header().incarnation;
  segment = Segment();

  EXPECT_FALSE(peers->hasOwner());
  EXPECT_EQ(segments::probeOwner(file_), segments::Owner::dead);
  EXPECT_EQ(segments::probeOwner(file_, incarnation), segments::Owner::dead);
  EXPECT_EQ(segments::probeOwner(file_, incarnation + 1), segments::Owner::absent)
      << "another segment has the name now";
}

TEST_F(SegmentTest, TheLockOfAKilledProcessIsReleased) {
  Child child([&](Child::Self& self) {
    auto segment = createPage();
    segment.lockForLife();
    if (segment.tryPublish(file_)) self.stay();
  });
  EXPECT_EQ(segments::probeOwner(file_), segments::Owner::alive);
  EXPECT_FALSE(segments::removeIfOwnerless(file_));
  child.stop();
  EXPECT_EQ(segments::probeOwner(file_), segments::Owner::alive) << "stopped is not dead";

  child.end(SIGKILL);

  EXPECT_EQ(segments::probeOwner(file_), segments::Owner::dead);
  EXPECT_TRUE(segments::removeIfOwnerless(file_));
  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
}

// Reapers and successors work on the same name. A process that holds the lock of a published
// segment finds the segment under its name until it releases the lock.
TEST_F(SegmentTest, ReapersNeverRemoveTheNameOfALivingOwner) {
  std::atomic<bool> end{false};
  std::vector<std::thread> reapers;
  for (int i = 0; i < 2; ++i) {
    reapers.emplace_back([&] {
      while (!end) static_cast<void>(segments::removeIfOwnerless(file_));
    });
  }

  for (int round = 0; round < 2000; ++round) {
    auto segment = createPage();
    segment.lockForLife();
    // until the segment of the last round is removed
    while (!segment.tryPublish(file_)) std::this_thread::yield();
    ASSERT_EQ(segments::probeOwner(file_, segment.header().incarnation), segments::Owner::alive);
    ASSERT_FALSE(segments::removeIfOwnerless(file_));
  }
  end = true;
  for (auto& reaper : reapers) reaper.join();
}

TEST_F(SegmentTest, IsOnlyForItsCreatorUnlessRightsSayOtherwise) {
  auto mine = createPage();
  ASSERT_TRUE(mine.tryPublish(file_));
  EXPECT_EQ(status().st_mode & 07777, 0600u);
  EXPECT_EQ(status().st_uid, ::getuid());
  segments::remove(file_);
  const auto group = ::getuid() == 0 ? 12345 : ::getgid();
  const auto umaskBefore = ::umask(0777);

  auto shared = createPage(SegmentKind::pendingBind, {.mode = 0640, .group = group});
  ::umask(umaskBefore);

  ASSERT_TRUE(shared.tryPublish(file_));
  EXPECT_EQ(status().st_mode & 07777, 0640u);
  EXPECT_EQ(status().st_gid, group);
}

TEST_F(SegmentTest, CreationFailsWithoutEnoughMemory) {
  for (const auto bytes : {std::size_t{1} << 50, std::size_t{1} << 62, SIZE_MAX}) {
    const auto why = whatOf<std::system_error>(
        [&] { static_cast<void>(Segment::create(bytes, SegmentKind::bulk, name(), {})); });
    EXPECT_THAT(why, testing::HasSubstr("reserve " + std::to_string(bytes) + " bytes in /dev/shm"));
  }
}

TEST_F(SegmentTest, ItsMemoryIsReservedFromTheStart) {
  auto segment = Segment::create(1 << 20, SegmentKind::bulk, name(), {});
  ASSERT_TRUE(segment.tryPublish(file_));

  EXPECT_GE(status().st_blocks * 512, 1 << 20);
  EXPECT_EQ(status().st_size, 1 << 20);
}

TEST_F(SegmentTest, IncarnationsDiffer) {
  std::set<std::uint64_t> seen;
  for (int i = 0; i < 1000; ++i) seen.insert(segments::newIncarnation());

  EXPECT_EQ(seen.size(), 1000u);
  EXPECT_FALSE(seen.contains(0));
}

}  // namespace
}  // namespace mpf::test
