// SPDX-License-Identifier: MIT
// Pool: chunks that are lent, returned, sent back and refused.
#include "shm/pool.h"

#include <cstring>
#include <map>
#include <optional>
#include <set>

#include "tests/shm/shm_fixture.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

class PoolTest : public ShmTest {
 protected:
  static constexpr std::uint64_t kLink = 0xabc;
  static constexpr std::uint32_t kSide = 1;

  void TearDown() override {
    owner_.reset();
    ShmTest::TearDown();
  }
  void makeOwner(std::uint64_t maxBytes) {
    owner_.reset();  // removes the names of its segments
    owner_.emplace(place_, Rights{}, maxBytes, returns_);
  }
  ChunkPlace placeOf(const Chunk& chunk) const { return owner_->tryFind(chunk.data).value(); }
  ChunkPlace lendOne(std::size_t bytes = 1000) {
    const auto place = placeOf(owner_->tryAlloc(bytes).value());
    owner_->lend(place);
    return place;
  }
  // The writable header of the owner's bulk segment `number`.
  Segment openBulk(std::uint32_t number = 0) const {
    return std::move(*Segment::tryOpen(SegmentName::bulk(name(), kLink, kSide, number),
                                       layout::SegmentKind::bulk, Segment::Access::readWrite));
  }

  PoolPlace place_{name(), kLink, kSide, 0xdef};
  layout::ReturnRing returns_{};
  std::optional<PoolOwner> owner_{std::in_place, place_, Rights{}, std::uint64_t{256} << 20,
                                  returns_};
  PoolBorrower borrower_{place_, std::uint64_t{256} << 20, returns_};
};

class ChunkSizes : public PoolTest, public testing::WithParamInterface<std::size_t> {};

TEST_P(ChunkSizes, AreAtLeastTheRequestedSizeAndTheBorrowerSeesAllBytes) {
  const auto bytes = GetParam();

  const auto chunk = owner_->tryAlloc(bytes);
  ASSERT_TRUE(chunk);
  ASSERT_GE(chunk->capacity, bytes);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(chunk->data) % layout::kCacheLineBytes, 0u);
  std::memset(chunk->data, 0x5a, chunk->capacity);
  owner_->lend(placeOf(*chunk));
  const auto borrowed = borrower_.tryBorrow(placeOf(*chunk));

  ASSERT_TRUE(borrowed);
  EXPECT_EQ(borrowed->capacity, chunk->capacity);
  EXPECT_NE(borrowed->data, chunk->data) << "a mapping of its own";
  EXPECT_EQ(std::memcmp(borrowed->data, chunk->data, chunk->capacity), 0);
}
INSTANTIATE_TEST_SUITE_P(SmallAndLarge, ChunkSizes,
                         testing::Values(0, 1, 193, 512, 640, 641, 1 << 20, (1 << 20) + 128,
                                         (1 << 20) + 129, std::size_t{64} << 20));

TEST_F(PoolTest, APowerOfTwoPlusAHeaderDoesNotDoubleTheChunk) {
  EXPECT_LT(owner_->tryAlloc((1 << 20) + 128)->capacity, (1u << 20) + 4096);
}

TEST_F(PoolTest, CreatesNoSegmentBeforeItIsNeeded) {
  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
  EXPECT_EQ(owner_->bytes(), 0u);

  ASSERT_TRUE(owner_->tryAlloc(1));

  EXPECT_THAT(backplane_.segmentNames(),
              testing::ElementsAre(SegmentName::bulk(name(), kLink, kSide, 0)));
  const auto header = openBulk().header();
  EXPECT_EQ(header.ownerWindow, place_.ownerWindow);
  EXPECT_EQ(header.bulkSide, kSide);
  EXPECT_EQ(header.totalBytes, owner_->bytes());
}

TEST_F(PoolTest, ReusesAReturnedChunk) {
  lendOne();
  const auto bytes = owner_->bytes();

  for (int i = 0; i < 10'000; ++i) {
    const auto lent = lendOne();
    ASSERT_TRUE(borrower_.tryBorrow(lent));
    borrower_.giveBack(lent);
  }

  EXPECT_EQ(owner_->bytes(), bytes);
}

TEST_F(PoolTest, HoldsAChunkThatThePeerSendsBack) {
  const auto chunk = owner_->tryAlloc(1000);
  ASSERT_TRUE(chunk);
  owner_->lend(placeOf(*chunk));

  const auto back = owner_->tryReceiveBack(placeOf(*chunk));

  ASSERT_TRUE(back);
  EXPECT_EQ(back->data, chunk->data);
  EXPECT_EQ(back->capacity, chunk->capacity);
  EXPECT_FALSE(owner_->tryReceiveBack(placeOf(*chunk))) << "already received back";
  owner_->free(placeOf(*back));
  EXPECT_FALSE(owner_->tryReceiveBack(placeOf(*chunk))) << "after it was freed";
}

TEST_F(PoolTest, TheOwnerRefusesAnInvalidReference) {
  const auto lent = lendOne();
  const auto held = placeOf(owner_->tryAlloc(1000).value());
  ASSERT_FALSE(owner_->tryReceiveBack(held)) << "not lent";

  for (const auto& wrong :
       {ChunkPlace{lent.segment + 1, lent.chunk}, ChunkPlace{lent.segment, 1u << 20},
        ChunkPlace{UINT32_MAX, UINT32_MAX}, ChunkPlace{lent.segment, lent.chunk + 2}}) {
    EXPECT_FALSE(owner_->tryReceiveBack(wrong)) << wrong.segment << ' ' << wrong.chunk;
  }
  EXPECT_TRUE(owner_->tryReceiveBack(lent));
}

TEST_F(PoolTest, TheBorrowerRefusesAnInvalidReference) {
  const auto lent = lendOne();
  const auto count = openBulk().header().chunkCount;

  for (const auto& wrong :
       {ChunkPlace{lent.segment, count}, ChunkPlace{lent.segment, UINT32_MAX},
        ChunkPlace{lent.segment + 1, 0}, ChunkPlace{256, 0}, ChunkPlace{UINT32_MAX, 0}}) {
    EXPECT_FALSE(borrower_.tryBorrow(wrong)) << wrong.segment << ' ' << wrong.chunk;
  }
  EXPECT_TRUE(borrower_.tryBorrow(lent));
}

class BulkHeaders : public PoolTest,
                    public testing::WithParamInterface<void (*)(layout::SegmentHeader&)> {};

TEST_P(BulkHeaders, AreRefusedByTheBorrowerIfInvalid) {
  const auto lent = lendOne();

  GetParam()(openBulk().sharedHeader());

  EXPECT_FALSE(borrower_.tryBorrow(lent));
}
INSTANTIATE_TEST_SUITE_P(
    Invalid, BulkHeaders,
    testing::Values([](layout::SegmentHeader& header) { header.chunkBytes = 0; },
                    [](layout::SegmentHeader& header) { header.chunkBytes = UINT64_MAX; },
                    [](layout::SegmentHeader& header) { header.chunkBytes += 64; },
                    [](layout::SegmentHeader& header) { header.chunkBytes = 1; },
                    [](layout::SegmentHeader& header) { header.chunkBytes -= 8; },
                    [](layout::SegmentHeader& header) { ++header.chunkCount; },
                    [](layout::SegmentHeader& header) { header.chunkCount = UINT32_MAX; },
                    [](layout::SegmentHeader& header) { header.chunkCount = 0; },
                    [](layout::SegmentHeader& header) { header.kind = layout::SegmentKind::link; },
                    [](layout::SegmentHeader& header) { header.magic = 0; },
                    [](layout::SegmentHeader& header) { header.totalBytes = UINT64_MAX; }));

TEST_F(PoolTest, FreesAChunkOnceIfItIsReturnedTwice) {
  const auto lent = lendOne();
  borrower_.giveBack(lent);
  borrower_.giveBack(lent);

  std::set<std::byte*> chunks;
  for (int i = 0; i < 100; ++i) chunks.insert(owner_->tryAlloc(1000)->data);

  EXPECT_EQ(chunks.size(), 100u);
}

TEST_F(PoolTest, ReturningAChunkThatIsNotLentFreesNothing) {
  const auto held = owner_->tryAlloc(1000);
  borrower_.giveBack(placeOf(*held));

  EXPECT_NE(owner_->tryAlloc(1000)->data, held->data);
}

TEST_F(PoolTest, RefusesAChunkAboveItsLimitUntilAnotherIsFreed) {
  constexpr std::uint64_t kLimit = 1 << 20;
  makeOwner(kLimit);
  std::vector<Chunk> chunks;

  while (const auto chunk = owner_->tryAlloc(50'000)) chunks.push_back(*chunk);

  EXPECT_GE(chunks.size(), 10u);
  EXPECT_LE(owner_->bytes(), kLimit);
  EXPECT_FALSE(owner_->tryAlloc(kLimit));
  owner_->free(placeOf(chunks.back()));
  EXPECT_EQ(owner_->tryAlloc(50'000)->data, chunks.back().data);
}

TEST_F(PoolTest, UsesItsLimitCompletely) {
  for (const std::uint64_t limit : {20'000u, 70'000u, 300'000u, 1'000'000u}) {
    makeOwner(limit);
    std::uint64_t chunks = 0;

    while (owner_->tryAlloc(10'000)) ++chunks;

    EXPECT_GE(chunks * 17'000 + 3 * layout::kPageBytes + 17'000, limit);
    EXPECT_LE(owner_->bytes(), limit);
  }
}

TEST_F(PoolTest, RefusesSizesAboveAnyLimit) {
  for (const auto bytes : {(std::size_t{256} << 20) + 1, std::size_t{1} << 40,
                           (std::size_t{1} << 63) + 1, SIZE_MAX - 127, SIZE_MAX}) {
    EXPECT_FALSE(owner_->tryAlloc(bytes)) << bytes;
  }
  EXPECT_EQ(owner_->bytes(), 0u);
}

TEST_F(PoolTest, LendsNoMoreChunksThanTheReturnRingHolds) {
  std::vector<ChunkPlace> lent;
  for (std::uint32_t i = 0; i < layout::kReturnSlots; ++i) lent.push_back(lendOne(100));

  EXPECT_FALSE(owner_->tryAlloc(100));

  for (const auto& place : lent) borrower_.giveBack(place);
  for (std::uint32_t i = 0; i < layout::kReturnSlots; ++i)
    ASSERT_TRUE(owner_->tryAlloc(100)) << "all chunks were returned: " << i;
}

TEST(ChunkSizeTest, FindsTheChunkOfEachByte) {
  for (const std::uint64_t bytes : {640ull, 1152ull, (1ull << 20) + 128, (1ull << 24) + 128}) {
    const ChunkSize size(bytes);
    for (const std::uint32_t chunk : {0u, 1u, 2u, 7u, 31u}) {
      EXPECT_EQ(size.chunkAt(chunk * bytes), chunk) << bytes;
      EXPECT_EQ(size.chunkAt(chunk * bytes + bytes - 1), chunk) << bytes;
    }
  }
  EXPECT_EQ(ChunkSize((1ull << 32) + 128).chunkAt(UINT32_MAX), 0u);
}

TEST_F(PoolTest, RecognizesPointersIntoItself) {
  const auto chunk = *owner_->tryAlloc(1000);
  owner_->lend(placeOf(chunk));
  const auto borrowed = *borrower_.tryBorrow(placeOf(chunk));
  const std::byte elsewhere{};

  const auto found = owner_->tryFind(chunk.data);
  const auto inside = borrower_.tryFind(borrowed.data + 10);

  ASSERT_TRUE(found && inside);
  EXPECT_EQ(owner_->tryFind(chunk.data + 999), found);
  EXPECT_EQ(inside, found);
  EXPECT_FALSE(owner_->tryFind(borrowed.data));
  EXPECT_FALSE(borrower_.tryFind(chunk.data));
  EXPECT_FALSE(owner_->tryFind(&elsewhere));
  EXPECT_FALSE(owner_->tryFind(nullptr));
}

TEST_F(PoolTest, BorrowedMemoryStaysReadableAfterTheOwnerIsDestroyed) {
  const auto chunk = *owner_->tryAlloc(1000);
  chunk.data[999] = std::byte{7};
  owner_->lend(placeOf(chunk));
  const auto borrowed = *borrower_.tryBorrow(placeOf(chunk));

  owner_.reset();

  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
  EXPECT_EQ(borrowed.data[999], std::byte{7});
}

TEST_F(PoolTest, RemovesAllBulkSegmentsOfALink) {
  ASSERT_TRUE(owner_->tryAlloc(1000));
  ASSERT_TRUE(owner_->tryAlloc(100'000));
  layout::ReturnRing otherReturns{};
  PoolOwner other({name(), kLink, 0, 0}, Rights{}, 1 << 20, otherReturns);
  ASSERT_TRUE(other.tryAlloc(1000));
  ASSERT_EQ(backplane_.segmentNames().size(), 3u);

  removeBulk(name(), kLink);

  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
}

// The borrower writes random data into the return ring. The owner never gives a chunk to two
// holders.
TEST_F(PoolTest, NoChunkHasTwoHoldersIfTheBorrowerWritesInvalidData) {
  makeOwner(4 << 20);
  Random random;
  std::map<std::byte*, Chunk> held;
  std::vector<Chunk> lent;

  for (int step = 0; step < 50'000; ++step) {
    switch (random.below(6)) {
      case 0:
      case 1:
        if (const auto chunk = owner_->tryAlloc(random.below(100'000))) {
          for (const auto& [data, other] : held)
            ASSERT_TRUE(chunk->data + chunk->capacity <= data ||
                        data + other.capacity <= chunk->data);
          held.emplace(chunk->data, *chunk);
        }
        break;
      case 2:
        if (held.empty()) break;
        if (random.oneIn(2)) {
          owner_->free(placeOf(held.begin()->second));
        } else {
          owner_->lend(placeOf(held.begin()->second));
          lent.push_back(held.begin()->second);
        }
        held.erase(held.begin());
        break;
      case 3:
        if (lent.empty()) break;
        if (const auto& one = lent[random.below(lent.size())];
            const auto back = owner_->tryReceiveBack(placeOf(one))) {
          ASSERT_TRUE(held.emplace(back->data, *back).second);
        }
        break;
      case 4:
        returns_.chunks[random.below(layout::kReturnSlots)].store(
            static_cast<std::uint32_t>(random.below(8) << 16 | random.below(8)),
            std::memory_order_relaxed);
        break;
      default:
        returns_.returned.store(random.nasty(), std::memory_order_relaxed);
    }
    if (step % 1000 == 0) lent.clear();
  }
}

}  // namespace
}  // namespace mpf::test
