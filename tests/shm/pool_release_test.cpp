// SPDX-License-Identifier: MIT
// Pool: segments without a chunk in use give their memory back when another size needs it.
#include <sys/stat.h>

#include <cstring>
#include <optional>
#include <vector>

#include "shm/pool.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class PoolRelease : public ShmTest {
 protected:
  static constexpr std::uint64_t kLink = 0xabc;

  void TearDown() override {
    owner_.reset();
    ShmTest::TearDown();
  }
  void makePool(std::uint64_t maxBytes) {
    owner_.emplace(place_, Rights{}, maxBytes, returns_);
    borrower_.emplace(place_, maxBytes, returns_);
  }
  ChunkPlace placeOf(const Chunk& chunk) const { return owner_->tryFind(chunk.data).value(); }
  // Fills the pool with chunks of this size, lets the borrower map them, and returns all.
  void burst(std::size_t bytes) {
    std::vector<ChunkPlace> lent;
    while (const auto chunk = owner_->tryAlloc(bytes)) {
      lent.push_back(placeOf(*chunk));
      owner_->lend(lent.back());
      ASSERT_TRUE(borrower_->tryBorrow(lent.back())) << lent.size();
    }
    for (const auto& place : lent) borrower_->giveBack(place);
  }
  // Memory that the files of the backplane use.
  std::uint64_t memory() const {
    std::uint64_t bytes = 0;
    for (const auto& file : backplane_.segmentNames()) {
      struct stat status{};
      if (::stat(segments::path(file).c_str(), &status) == 0)
        bytes += static_cast<std::uint64_t>(status.st_blocks) * 512;
    }
    return bytes;
  }

  PoolPlace place_{name(), kLink, 1, 0xdef};
  layout::ReturnRing returns_{};
  std::optional<PoolOwner> owner_;
  std::optional<PoolBorrower> borrower_;
};

TEST_F(PoolRelease, ALargeChunkGetsTheMemoryThatSmallOnesNoLongerUse) {
  constexpr std::uint64_t kLimit = 1 << 20;
  makePool(kLimit);
  burst(10'000);
  const auto segments = backplane_.segmentNames().size();

  const auto chunk = owner_->tryAlloc(500'000);

  ASSERT_TRUE(chunk);
  EXPECT_LE(owner_->bytes(), kLimit);
  EXPECT_LE(memory(), kLimit + (segments + 1) * layout::kPageBytes);
  std::memset(chunk->data, 0x5a, chunk->capacity);
  owner_->lend(placeOf(*chunk));
  const auto borrowed = borrower_->tryBorrow(placeOf(*chunk));
  ASSERT_TRUE(borrowed);
  EXPECT_EQ(std::memcmp(borrowed->data, chunk->data, chunk->capacity), 0);
}

TEST_F(PoolRelease, ReusesTheNamesOfReleasedSegmentsForTheSameChunks) {
  constexpr std::uint64_t kLimit = 1 << 20;
  makePool(kLimit);
  for (const std::size_t bytes : {10'000, 500'000}) burst(bytes);
  const auto segments = backplane_.segmentNames();

  for (int round = 0; round < 20; ++round) {
    for (const std::size_t bytes : {10'000, 500'000}) burst(bytes);
  }

  EXPECT_EQ(backplane_.segmentNames(), segments);
  removeBulk(name(), kLink);
  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
}

TEST_F(PoolRelease, KeepsTheSegmentsWithAChunkInUse) {
  constexpr std::uint64_t kLimit = 1 << 20;
  makePool(kLimit);
  const auto held = *owner_->tryAlloc(10'000);
  std::memset(held.data, 0x5a, held.capacity);
  burst(10'000);

  const auto large = owner_->tryAlloc(500'000);
  const auto small = owner_->tryAlloc(10'000);

  ASSERT_TRUE(large && small);
  EXPECT_NE(small->data, held.data);
  EXPECT_EQ(held.data[0], std::byte{0x5a});
  EXPECT_EQ(held.data[held.capacity - 1], std::byte{0x5a});
}

TEST_F(PoolRelease, KeepsAllMemoryIfTheRestIsTooLittle) {
  makePool(1 << 20);
  ASSERT_TRUE(owner_->tryAlloc(500'000));
  burst(10'000);
  const auto before = memory();

  EXPECT_FALSE(owner_->tryAlloc(500'000));

  EXPECT_EQ(memory(), before);
}

TEST_F(PoolRelease, ABurstOfEachSizeLeavesRoomForFurtherSegments) {
  makePool(std::uint64_t{256} << 20);

  for (std::size_t bytes = 512; bytes <= std::size_t{64} << 20; bytes *= 2) burst(bytes);

  EXPECT_TRUE(owner_->tryAlloc(std::size_t{128} << 20));
}

}  // namespace
}  // namespace mpf::test
