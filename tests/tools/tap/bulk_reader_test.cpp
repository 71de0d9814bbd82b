// SPDX-License-Identifier: MIT
// BulkReader: bodies in a pool of this process.
#include "tools/tap/bulk_reader.h"

#include <cstring>
#include <optional>

#include "shm/fan_out_pool.h"
#include "shm/pool.h"
#include "shm/segment_name.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::tools {
namespace {

using layout::ChunkRef;
using testing::HasSubstr;
using testing::StartsWith;

class BulkReaderTest : public test::ShmTest {
 protected:
  static constexpr std::uint64_t kLink = 0xabc;
  static constexpr std::uint64_t kServer = 0xdef;

  void TearDown() override {
    owner_.reset();
    ShmTest::TearDown();
  }
  // A chunk of the server's pool, filled with this byte.
  ChunkRef write(std::byte value, std::size_t bytes = 1000) {
    const auto chunk = owner_->tryAlloc(bytes);
    EXPECT_TRUE(chunk);
    std::memset(chunk->data, std::to_integer<int>(value), bytes);
    const auto place = owner_->tryFind(chunk->data).value();
    owner_->lend(place);
    return {place.segment, place.chunk, 1, 0};
  }
  [[nodiscard]] std::string bulkPath() const {
    return segments::path(SegmentName::bulk(name(), kLink, 1, 0));
  }
  [[nodiscard]] Segment openBulk() const {
    return std::move(*Segment::tryOpen(SegmentName::bulk(name(), kLink, 1, 0),
                                       layout::SegmentKind::bulk, Segment::Access::readWrite));
  }
  // The error when `bytes` bytes of the chunk are read by a reader that opens the pool for it.
  [[nodiscard]] std::string refusal(const ChunkRef& ref, std::size_t bytes = 8) const {
    return test::whatOf<SegmentError>(
        [&] { static_cast<void>(BulkReader(name(), kLink, kServer).read(ref, bytes)); });
  }

  layout::ReturnRing returns_{};
  std::optional<PoolOwner> owner_{std::in_place, PoolPlace{name(), kLink, 1, 0xdef}, Rights{},
                                  std::uint64_t{64} << 20, returns_};
  BulkReader reader_{name(), kLink, kServer};
};

TEST_F(BulkReaderTest, CopiesTheBytesOfEachChunk) {
  const auto first = write(std::byte{1});
  const auto second = write(std::byte{2});
  const auto large = write(std::byte{3}, 2 << 20);  // in another segment

  EXPECT_EQ(reader_.read(first, 1000), std::vector(1000, std::byte{1}));
  EXPECT_EQ(reader_.read(second, 10), std::vector(10, std::byte{2}));
  EXPECT_EQ(reader_.read(large, 2 << 20), std::vector(2 << 20, std::byte{3}));
  EXPECT_TRUE(reader_.read(first, 0).empty());
}

// The server of a removed link may have ended: what it sent is read to the end.
TEST_F(BulkReaderTest, ReadsAPoolThatItKnowsAfterItWasRemoved) {
  const auto ref = write(std::byte{1});
  EXPECT_EQ(reader_.read(ref, 1).front(), std::byte{1});

  owner_.reset();

  EXPECT_EQ(reader_.read(ref, 1000), std::vector(1000, std::byte{1}));
  EXPECT_EQ(refusal(ref), bulkPath() + ": the pool no longer exists");
}

TEST_F(BulkReaderTest, RefusesAReferenceThatDoesNotFitTheSegment) {
  auto ref = write(std::byte{1});
  const auto bulk = openBulk();
  const auto chunks = bulk.header().chunkCount;
  const auto chunkBytes = bulk.header().chunkBytes;

  EXPECT_THAT(refusal(ref, chunkBytes + 1), StartsWith(bulkPath() + ": "));
  EXPECT_EQ(refusal(ref, chunkBytes), "");
  ref.chunk = chunks - 1;
  EXPECT_EQ(refusal(ref), "");
  ref.chunk = chunks;
  EXPECT_THAT(refusal(ref), HasSubstr("8 bytes of chunk " + std::to_string(chunks) +
                                      " are not in " + std::to_string(chunks) + " chunks of "));
  ref.side = 3;
  EXPECT_EQ(refusal(ref),
            "a chunk of side 3; the sides of a link are 0 and 1, the fan-out pool is 2");
}

TEST_F(BulkReaderTest, ReadsTheFanOutPoolOfTheServer) {
  std::optional<FanOutPool> pool(std::in_place, name(), kServer, Rights{}, 1 << 20);
  const auto chunk = pool->tryAlloc(1000);
  std::memset(chunk->data(), 5, 1000);
  const ChunkRef ref{chunk->number(), 0, layout::kFanOutSide, 0};

  EXPECT_EQ(reader_.read(ref, 1000), std::vector(1000, std::byte{5}));
  EXPECT_THAT(refusal({chunk->number(), 1, layout::kFanOutSide, 0}),
              HasSubstr("8 bytes of chunk 1"));
  const auto path = segments::path(chunk->segment().name());
  pool.reset();

  EXPECT_EQ(refusal(ref), path + ": the pool no longer exists");
}

// The header is in shared memory: its owner may write anything.
TEST_F(BulkReaderTest, RefusesAHeaderThatDoesNotFitTheFile) {
  const auto ref = write(std::byte{1});
  const auto bulk = openBulk();
  auto& header = bulk.sharedHeader();
  const auto chunks = header.chunkCount;
  const auto chunkBytes = header.chunkBytes;
  EXPECT_EQ(refusal(ref), "");

  header.chunkCount = chunks * 1000;
  EXPECT_THAT(refusal(ref), HasSubstr(" are not in "));
  header.chunkCount = chunks;
  header.chunkBytes = std::uint64_t{1} << 60;
  EXPECT_THAT(refusal(ref, std::size_t{1} << 50), HasSubstr(" are not in "));
  header.chunkBytes = 0;
  EXPECT_THAT(refusal(ref), HasSubstr(" are not in "));
  EXPECT_THAT(refusal(ref, 0), HasSubstr(" are not in "));

  header.chunkBytes = chunkBytes;
  EXPECT_EQ(refusal(ref), "");
}

}  // namespace
}  // namespace mpf::tools
