// SPDX-License-Identifier: MIT
// FanOutBorrower: a client reads chunks of the server, and may write to copies.
#include "shm/fan_out_borrower.h"

#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "shm/fan_out_pool.h"
#include "shm/private_pages.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class FanOutBorrowerTest : public ShmTest {
 protected:
  static constexpr std::uint64_t kServer = 0xabc;
  static constexpr std::size_t kBytes = 100'000;

  std::optional<Chunk> tryBorrow(const FanOutChunk& chunk) {
    return borrower_.tryBorrow({chunk.number(), 0}, 0);
  }
  std::shared_ptr<FanOutChunk> allocFilled(int with) {
    auto chunk = pool_->tryAlloc(kBytes);
    std::memset(chunk->data(), with, kBytes);
    return chunk;
  }
  // The number of this process's mappings of the pool.
  static std::size_t mappings() {
    std::ifstream maps("/proc/self/maps");
    std::size_t count = 0;
    for (std::string line; std::getline(maps, line);)
      count += line.find(".p.abc.") != std::string::npos ? 1 : 0;
    return count;
  }
  void TearDown() override {
    pool_.reset();
    ShmTest::TearDown();
  }

  std::optional<FanOutPool> pool_{std::in_place, name(), kServer, Rights{}, std::uint64_t{1} << 26};
  FanOutBorrower borrower_{name(), kServer};
};

TEST_F(FanOutBorrowerTest, ReadsTheChunkOfTheServer) {
  const auto chunk = allocFilled(7);

  const auto borrowed = tryBorrow(*chunk);

  ASSERT_TRUE(borrowed);
  EXPECT_EQ(borrowed->capacity, chunk->capacity());
  EXPECT_EQ(std::memcmp(borrowed->data, chunk->data(), kBytes), 0);
}

TEST_F(FanOutBorrowerTest, WritesNeitherTheChunkNorOtherViewsOfIt) {
  const auto chunk = allocFilled(7);
  const auto one = tryBorrow(*chunk);
  const auto two = tryBorrow(*chunk);
  ASSERT_TRUE(one && two);

  std::memset(one->data, 1, kBytes);

  EXPECT_EQ(two->data[50], std::byte{7});
  EXPECT_EQ(chunk->data()[50], std::byte{7});
}

TEST_F(FanOutBorrowerTest, ShowsTheNextContentsAfterAWrite) {
  const auto chunk = allocFilled(7);
  const auto first = tryBorrow(*chunk);
  first->data[5000] = std::byte{1};
  private_pages::drop(first->data, first->capacity);
  ASSERT_TRUE(borrower_.tryRelease(first->data));
  std::memset(chunk->data(), 8, kBytes);

  const auto next = tryBorrow(*chunk);

  EXPECT_EQ(next->data, first->data) << "the mapping is used again";
  EXPECT_EQ(std::memcmp(next->data, chunk->data(), kBytes), 0);
}

TEST_F(FanOutBorrowerTest, ReleasesOnlyWhatItHolds) {
  const auto chunk = allocFilled(7);
  const auto borrowed = tryBorrow(*chunk);

  EXPECT_FALSE(borrower_.tryRelease(borrowed->data + 1));
  const auto released = borrower_.tryRelease(borrowed->data);
  EXPECT_FALSE(borrower_.tryRelease(borrowed->data));

  ASSERT_TRUE(released);
  EXPECT_EQ(*released, chunk->number());
}

TEST_F(FanOutBorrowerTest, RefusesWhatIsNoChunkOfTheServer) {
  const auto chunk = allocFilled(7);

  EXPECT_FALSE(borrower_.tryBorrow({chunk->number() + 1, 0}, 0));
  EXPECT_FALSE(borrower_.tryBorrow({chunk->number(), 1}, 0));
  EXPECT_FALSE(borrower_.tryBorrow({UINT32_MAX, 0}, 0));
}

TEST_F(FanOutBorrowerTest, StaysReadableWhenTheServerRemovesThePool) {
  const auto chunk = allocFilled(7);
  const auto borrowed = tryBorrow(*chunk);

  pool_.reset();

  EXPECT_EQ(borrowed->data[kBytes - 1], std::byte{7});
}

TEST_F(FanOutBorrowerTest, UnmapsWhatTheServerHasRemoved) {
  for (int i = 0; i < 20; ++i) {
    const auto chunk = allocFilled(i);
    const auto borrowed = tryBorrow(*chunk);
    ASSERT_TRUE(borrowed && borrower_.tryRelease(borrowed->data));
    chunk->retire();
    chunk->drop();
    pool_->removeRetired();
  }

  EXPECT_LE(mappings(), 3u) << "the server's and the last of the client's";
}

TEST_F(FanOutBorrowerTest, MapsABoundedNumberOfSegments) {
  std::vector<std::shared_ptr<FanOutChunk>> chunks;
  std::size_t held = 0;
  while (chunks.size() < FanOutBorrower::kMaxMappings) chunks.push_back(pool_->tryAlloc(1));
  for (const auto& chunk : chunks) held += tryBorrow(*chunk) ? 1 : 0;
  EXPECT_EQ(held, FanOutBorrower::kMaxMappings);

  EXPECT_FALSE(tryBorrow(*chunks[0])) << "would need another mapping";
}

}  // namespace
}  // namespace mpf::test
