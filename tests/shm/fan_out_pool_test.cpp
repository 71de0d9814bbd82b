// SPDX-License-Identifier: MIT
// FanOutPool: chunks with several holders are free again after the last of them.
#include "shm/fan_out_pool.h"

#include <sys/stat.h>

#include <barrier>
#include <optional>
#include <thread>
#include <vector>

#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class FanOutPoolTest : public ShmTest {
 protected:
  static constexpr std::uint64_t kServer = 0xabc;
  static constexpr std::size_t kBytes = 100'000;

  void makePool(std::uint64_t maxBytes, Rights rights = {}) {
    pool_.reset();
    pool_.emplace(name(), kServer, rights, maxBytes);
  }
  void TearDown() override {
    pool_.reset();
    ShmTest::TearDown();
  }
  std::optional<FanOutPool> pool_{std::in_place, name(), kServer, Rights{}, std::uint64_t{1} << 24};
};

TEST_F(FanOutPoolTest, AChunkIsASegmentOfWholePagesThatReadersCannotWrite) {
  const auto chunk = pool_->tryAlloc(kBytes);

  ASSERT_TRUE(chunk);
  EXPECT_GE(chunk->capacity(), kBytes);
  EXPECT_EQ(chunk->capacity() % layout::kPageBytes, 0u);
  const auto file = SegmentName::fanOut(name(), kServer, 0);
  EXPECT_THAT(backplane_.segmentNames(), testing::ElementsAre(file));
  struct stat status{};
  ASSERT_EQ(::stat(segments::path(file).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0400u);
  const auto header = segments::tryReadHeader(file, layout::SegmentKind::fanOut);
  EXPECT_EQ(header->ownerWindow, kServer);
  EXPECT_EQ(header->chunkBytes, chunk->capacity());
}

TEST_F(FanOutPoolTest, ReadersMayReadWhatTheServerOffers) {
  makePool(1 << 24, {.mode = 0666});
  ASSERT_TRUE(pool_->tryAlloc(1));

  struct stat status{};
  ASSERT_EQ(::stat(segments::path(backplane_.segmentNames().at(0)).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0444u);
}

TEST_F(FanOutPoolTest, AChunkIsFreeAfterItsLastHolder) {
  const auto chunk = pool_->tryAlloc(kBytes);
  chunk->hold();

  chunk->drop();
  EXPECT_NE(pool_->tryAlloc(kBytes), chunk) << "one holder is left";
  chunk->drop();

  EXPECT_EQ(pool_->tryAlloc(kBytes), chunk);
}

TEST_F(FanOutPoolTest, ARetiredChunkIsNeverUsedAgainAndItsFileIsRemoved) {
  auto chunk = pool_->tryAlloc(kBytes);
  const auto file = chunk->segment().name();
  chunk->retire();
  pool_->removeRetired();
  EXPECT_TRUE(segments::exists(file)) << "another holder may not have mapped it yet";

  chunk->drop();
  pool_->removeRetired();

  EXPECT_FALSE(segments::exists(file));
  EXPECT_EQ(pool_->bytes(), 0u);
  const auto next = pool_->tryAlloc(kBytes);
  EXPECT_NE(next, chunk);
  EXPECT_EQ(next->number(), 1u) << "no number is used twice";
}

TEST_F(FanOutPoolTest, RefusesAboveItsLimitUntilAChunkIsFree) {
  makePool(3 * (kBytes + 2 * layout::kPageBytes));
  std::vector<std::shared_ptr<FanOutChunk>> chunks;
  while (auto chunk = pool_->tryAlloc(kBytes)) chunks.push_back(std::move(chunk));
  EXPECT_EQ(chunks.size(), 3u);

  chunks.back()->drop();

  EXPECT_TRUE(pool_->tryAlloc(kBytes));
}

TEST_F(FanOutPoolTest, FreeChunksOfAnotherSizeMakeRoom) {
  makePool(910'000);
  pool_->tryAlloc(900'000)->drop();

  EXPECT_TRUE(pool_->tryAlloc(100));
  EXPECT_EQ(backplane_.segmentNames().size(), 1u);
}

TEST_F(FanOutPoolTest, RefusesWhatNoSegmentCanHold) {
  EXPECT_FALSE(pool_->tryAlloc(std::size_t{1} << 40));
  EXPECT_EQ(pool_->bytes(), 0u);
}

TEST_F(FanOutPoolTest, FindsTheChunkOfAnAddress) {
  const auto one = pool_->tryAlloc(kBytes);
  const auto two = pool_->tryAlloc(kBytes);

  EXPECT_EQ(pool_->tryFind(two->data() + kBytes - 1), two);
  EXPECT_EQ(pool_->tryFind(one->data()), one);
  EXPECT_FALSE(pool_->tryFind(one->data() - 1));
}

TEST_F(FanOutPoolTest, ThreadsNeverGetTheSameChunk) {
  std::barrier start(2);
  const auto fill = [&](std::uint8_t mark) {
    start.arrive_and_wait();
    for (int i = 0; i < 100'000; ++i) {
      const auto chunk = pool_->tryAlloc(100);
      ASSERT_TRUE(chunk);
      auto* const bytes = reinterpret_cast<std::uint8_t*>(chunk->data());
      bytes[0] = mark;
      bytes[99] = mark;
      if (i % 100 == 0) std::this_thread::yield();
      ASSERT_EQ(bytes[0], mark);
      ASSERT_EQ(bytes[99], mark);
      chunk->drop();
    }
  };

  std::thread other(fill, 1);
  fill(2);
  other.join();

  EXPECT_LE(backplane_.segmentNames().size(), 2u);
}

}  // namespace
}  // namespace mpf::test
