// SPDX-License-Identifier: MIT
// The memory of a segment is reserved when the segment is created. This file replaces
// posix_fallocate(), so that a test chooses the kernel's answer.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <functional>

#include "shm/pool.h"
#include "shm/window.h"
#include "tests/shm/shm_fixture.h"

namespace {

// The error that replaces the kernel's answer; 0: the kernel reserves the memory.
std::function<int(off_t bytes)> answer = [](off_t) { return 0; };

}  // namespace

extern "C" int posix_fallocate(int fd, off_t offset, off_t bytes) noexcept(false) {
  if (const int error = answer(bytes); error != 0) return error;
  return ::fallocate(fd, 0, offset, bytes) == 0 ? 0 : errno;
}

namespace mpf::test {
namespace {

class Reserve : public ShmTest {
 protected:
  ~Reserve() override {
    answer = [](off_t) { return 0; };
  }
  [[nodiscard]] Segment create(std::size_t bytes) const {
    return Segment::create(bytes, layout::SegmentKind::bulk, name(), {});
  }
};

TEST_F(Reserve, AShortageIsAnErrorThatNamesTheRequestedSize) {
  answer = [](off_t) { return ENOSPC; };

  const auto why = whatOf<std::system_error>([&] { static_cast<void>(create(4096)); });

  EXPECT_THAT(why, testing::AllOf(testing::HasSubstr("reserve 4096 bytes in /dev/shm"),
                                  testing::HasSubstr("No space left")));
}

// Some kernels undo a long reservation at each tick of a timer.
TEST_F(Reserve, RetriesAfterSignals) {
  int calls = 0;
  answer = [&](off_t bytes) { return bytes > 1 << 20 || ++calls % 2 == 1 ? EINTR : 0; };
  constexpr std::size_t kBytes = (std::size_t{5} << 20) + 4096;

  const auto segment = create(kBytes);

  EXPECT_EQ(segment.bytes(), kBytes);
  EXPECT_EQ(calls, 12);
}

// The repair of a truncated file runs in a signal handler, where timers tick, too.
TEST_F(Reserve, RetriesToGrowATruncatedFileAfterSignals) {
  const OwnWindow window(name(), layout::SegmentKind::serverWindow,
                         SegmentName::serverWindow(name(), 0, "s"), Rights{},
                         [](layout::SegmentHeader&) {});
  const auto path =
      segments::path(SegmentName::keyed(name(), NameKind::hints, window.header().incarnation));
  ASSERT_EQ(::truncate(path.c_str(), 0), 0);
  int calls = 0;
  answer = [&](off_t) { return ++calls <= 2 ? EINTR : 0; };

  window.hints().bell.store(7, std::memory_order_relaxed);

  struct stat status{};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_GT(status.st_size, 0);
  EXPECT_EQ(calls, 3);
}

TEST_F(Reserve, ReportsAShortageAfterSignals) {
  int calls = 0;
  answer = [&](off_t) { return ++calls < 5 ? EINTR : ENOSPC; };

  EXPECT_THROW(static_cast<void>(create(std::size_t{5} << 20)), std::system_error);
}

TEST_F(Reserve, AllocatesNoChunkDuringAShortageAndOneAfterIt) {
  layout::ReturnRing returns{};
  PoolOwner pool({name(), 1, 0, 0}, Rights{}, 1 << 20, returns);
  answer = [](off_t) { return ENOSPC; };

  EXPECT_FALSE(pool.tryAlloc(1000));

  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
  EXPECT_EQ(pool.bytes(), 0u);
  answer = [](off_t) { return 0; };
  EXPECT_TRUE(pool.tryAlloc(1000));
}

// The kernel has no room for another segment before the pool has released its first one.
TEST_F(Reserve, AShortageReleasesTheSegmentsWithoutAChunkInUse) {
  layout::ReturnRing returns{};
  PoolOwner pool({name(), 1, 0, 0}, Rights{}, 1 << 20, returns);
  pool.free(pool.tryFind(pool.tryAlloc(1000).value().data).value());
  const auto path = segments::path(SegmentName::bulk(name(), 1, 0, 0));
  answer = [path](off_t) {
    struct stat status{};
    const bool isReleased = ::stat(path.c_str(), &status) == 0 &&
                            status.st_blocks * 512 == static_cast<off_t>(layout::kPageBytes);
    return isReleased ? 0 : ENOSPC;
  };

  EXPECT_TRUE(pool.tryAlloc(100'000));
}

TEST_F(Reserve, AReleasedSegmentIsNotUsedDuringAShortage) {
  constexpr std::uint64_t kLimit = 300'000;
  layout::ReturnRing returns{};
  PoolOwner pool({name(), 1, 0, 0}, Rights{}, kLimit, returns);
  for (const std::size_t bytes : {100'000, 200'000})
    pool.free(pool.tryFind(pool.tryAlloc(bytes).value().data).value());
  answer = [](off_t) { return ENOSPC; };

  EXPECT_FALSE(pool.tryAlloc(100'000));

  answer = [](off_t) { return 0; };
  EXPECT_TRUE(pool.tryAlloc(100'000));
}

}  // namespace
}  // namespace mpf::test
