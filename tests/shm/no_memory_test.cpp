// SPDX-License-Identifier: MIT
// Shared memory in a process without memory of its own: a failure leaves no file, and blocks
// nothing that comes later.
#include <vector>

#include "shm/doorbell.h"
#include "shm/fan_out_pool.h"
#include "shm/pool.h"
#include "tests/shm/shm_fixture.h"
#include "tests/support/limited_memory.h"

namespace mpf::test {
namespace {

constexpr int kMost = 30;  // more allocations than a function below makes

using NoMemoryTest = ShmTest;

TEST_F(NoMemoryTest, APoolGrowsAfterItCouldNot) {
  for (int allocations = 0; allocations < kMost; ++allocations) {
    layout::ReturnRing returns{};
    PoolOwner owner({name(), 0xabc, 1, 0xdef}, Rights{}, std::uint64_t{1} << 24, returns);
    {
      const LimitedMemory limit(allocations);
      static_cast<void>(owner.tryAlloc(1000));
    }

    EXPECT_TRUE(owner.tryAlloc(1000)) << "after " << allocations << " allocations";

    EXPECT_EQ(backplane_.segmentNames().size(), 1u) << allocations;
  }
}

TEST_F(NoMemoryTest, AFanOutChunkThatCannotBeMadeLeavesNoFile) {
  for (int allocations = 0; allocations < kMost; ++allocations) {
    {
      FanOutPool pool(name(), 0xabc, Rights{}, std::uint64_t{1} << 24);
      const LimitedMemory limit(allocations);
      static_cast<void>(pool.tryAlloc(1000));
    }

    EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty()) << allocations;
  }
}

// A sender opens the FIFO when its peer first sleeps at its descriptor.
TEST_F(NoMemoryTest, AFifoIsOpened) {
  const auto fifoName = SegmentName::keyed(name(), NameKind::fifo, 1);
  const auto own = doorbell::createFifo(fifoName, 0600, ~0u);
  FileDescriptor peers;
  {
    const LimitedMemory limit(0);
    peers = doorbell::tryOpenFifo(fifoName);
  }

  EXPECT_TRUE(peers);
  segments::remove(fifoName);
}

}  // namespace
}  // namespace mpf::test
