// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/interrupt.h>

#include <poll.h>

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

// A line that the test announces.
class AnnouncedInterrupt final : public Interrupt {
 public:
  using Interrupt::announce;
  void enable() override {}
  void disable() noexcept override {}
  [[nodiscard]] bool isReadable() const {
    pollfd readable{descriptor(), POLLIN, 0};
    return ::poll(&readable, 1, 0) == 1;
  }
};

TEST(InterruptTest, IsReadableFromTheAnnouncementUntilItIsTaken) {
  AnnouncedInterrupt interrupt;
  EXPECT_FALSE(interrupt.isReadable());
  EXPECT_EQ(interrupt.take(), 0U);

  interrupt.announce();

  EXPECT_TRUE(interrupt.isReadable());
  EXPECT_EQ(interrupt.take(), 1U);
  EXPECT_FALSE(interrupt.isReadable());
  EXPECT_EQ(interrupt.take(), 0U);
}

TEST(InterruptTest, CountsTheAnnouncementsThatWereNotTaken) {
  AnnouncedInterrupt interrupt;
  for (int i = 0; i < 3; ++i) interrupt.announce();

  EXPECT_EQ(interrupt.take(), 3U);
}

TEST(InterruptTest, HasTheDefaultPriorityUntilAnotherOneIsSet) {
  AnnouncedInterrupt interrupt;
  EXPECT_EQ(interrupt.priority(), kInterruptPriority);
  EXPECT_FALSE(interrupt.isPolled());

  interrupt.setPriority(0);

  EXPECT_EQ(interrupt.priority(), 0);
}

}  // namespace
}  // namespace mpf::test
