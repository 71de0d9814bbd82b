// SPDX-License-Identifier: MIT
// Shared memory in a process without memory of its own: a failure leaves no file, and blocks
// nothing that comes later.
#include "shm/doorbell.h"
#include "tests/shm/shm_fixture.h"
#include "tests/support/limited_memory.h"

namespace mpf::test {
namespace {

using NoMemoryTest = ShmTest;

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
