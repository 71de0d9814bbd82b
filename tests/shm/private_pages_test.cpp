// SPDX-License-Identifier: MIT
// Private pages: the copies that a process makes by writing are found and dropped.
#include "shm/private_pages.h"

#include <sys/mman.h>

#include "tests/shm/shm_fixture.h"
#include "tests/support/sanitized.h"

namespace mpf::test {
namespace {

TEST(PrivatePages, AreFoundOnAnyPageThatWasWritten) {
  const TestBackplane backplane;
  constexpr std::size_t kPages = 1500;  // more than are read at a time
  auto segment = Segment::create(kPages * layout::kPageBytes, layout::SegmentKind::fanOut,
                                 backplane.name(), {});
  const auto name = SegmentName::fanOut(backplane.name(), 1, 0);
  ASSERT_TRUE(segment.tryPublish(name));
  const auto view =
      Segment::tryOpen(name, layout::SegmentKind::fanOut, Segment::Access::copyOnWrite);
  segments::remove(name);
  for (const std::size_t page : {std::size_t{1}, std::size_t{512}, kPages - 1}) {
    auto* const at = view->data() + page * layout::kPageBytes;
    EXPECT_EQ(*at, std::byte{0});  // present, but a page of the file
    EXPECT_FALSE(private_pages::mayExist(view->data(), view->bytes()));

    *at = std::byte{1};
    EXPECT_TRUE(private_pages::mayExist(view->data(), view->bytes()));
    EXPECT_FALSE(private_pages::mayExist(view->data(), page * layout::kPageBytes));
    private_pages::drop(view->data(), view->bytes());

    EXPECT_FALSE(private_pages::mayExist(view->data(), view->bytes()));
    EXPECT_EQ(*at, std::byte{0});
  }
}

// mlock() copies all pages of such a mapping; mlockall() does so when they are mapped.
TEST(PrivatePages, OfLockedMemoryAreDropped) {
  if (kIsSanitized) GTEST_SKIP() << "mlock() and munlock() of the sanitizers do nothing";
  const TestBackplane backplane;
  auto segment =
      Segment::create(4 * layout::kPageBytes, layout::SegmentKind::fanOut, backplane.name(), {});
  const auto name = SegmentName::fanOut(backplane.name(), 1, 0);
  ASSERT_TRUE(segment.tryPublish(name));
  const auto view =
      Segment::tryOpen(name, layout::SegmentKind::fanOut, Segment::Access::copyOnWrite);
  segments::remove(name);
  if (::mlock(view->data(), view->bytes()) != 0) GTEST_SKIP() << "this user may not lock memory";
  auto* const last = view->data() + view->bytes() - 1;
  segment.data()[view->bytes() - 1] = std::byte{7};
  EXPECT_EQ(*last, std::byte{0}) << "mlock() makes no copies on this kernel";

  private_pages::drop(view->data(), view->bytes());

  EXPECT_EQ(*last, std::byte{7});
}

}  // namespace
}  // namespace mpf::test
