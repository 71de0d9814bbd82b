// SPDX-License-Identifier: MIT
// Knocks: each knock is taken once, and invalid hints cost a limited number of looks.
#include "shm/knocks.h"

#include <gtest/gtest.h>
#include <memory>

namespace mpf::test {
namespace {

class KnocksTest : public testing::Test {
 protected:
  // What PeerWindow::knock() writes.
  void knock(std::uint64_t incarnation) {
    hints_->knocks[incarnation % layout::kKnocks].store(incarnation, std::memory_order_relaxed);
    hints_->knocked.fetch_add(1, std::memory_order_relaxed);
  }

  std::unique_ptr<layout::WindowHints> hints_ = std::make_unique<layout::WindowHints>();
  Knocks knocks_{*hints_};
};

TEST_F(KnocksTest, AreTakenOnce) {
  EXPECT_FALSE(knocks_.hasAny());
  EXPECT_FALSE(knocks_.tryTake());
  knock(5);
  knock(6);
  EXPECT_TRUE(knocks_.hasAny());

  EXPECT_EQ(knocks_.tryTake(), 5u);
  EXPECT_TRUE(knocks_.hasAny()) << "true until tryTake() has returned nothing";
  EXPECT_EQ(knocks_.tryTake(), 6u);
  EXPECT_FALSE(knocks_.tryTake());

  EXPECT_FALSE(knocks_.hasAny());
}

TEST_F(KnocksTest, ThatArriveBetweenTwoCallsAreTaken) {
  knock(60);
  EXPECT_EQ(knocks_.tryTake(), 60u);
  knock(1);

  EXPECT_EQ(knocks_.tryTake(), 1u) << "in a place before the one that was looked at last";

  EXPECT_FALSE(knocks_.tryTake());
}

TEST_F(KnocksTest, ARescanIsTakenOnce) {
  EXPECT_FALSE(knocks_.takeRescan());
  hints_->rescan.store(1, std::memory_order_relaxed);
  EXPECT_TRUE(knocks_.hasAny());

  EXPECT_TRUE(knocks_.takeRescan());

  EXPECT_FALSE(knocks_.takeRescan());
  EXPECT_FALSE(knocks_.hasAny());
}

TEST_F(KnocksTest, AFloodIsLimitedToTheNumberOfPlaces) {
  for (auto& place : hints_->knocks) place.store(UINT64_MAX, std::memory_order_relaxed);
  hints_->knocked.store(UINT32_MAX, std::memory_order_relaxed);

  std::uint32_t taken = 0;
  while (knocks_.tryTake()) ++taken;

  EXPECT_EQ(taken, layout::kKnocks);
  EXPECT_FALSE(knocks_.hasAny());
}

TEST_F(KnocksTest, ACountWithoutAKnockIsPassedOnce) {
  hints_->knocked.store(9, std::memory_order_relaxed);
  EXPECT_TRUE(knocks_.hasAny());

  EXPECT_FALSE(knocks_.tryTake());

  EXPECT_FALSE(knocks_.hasAny());
}

}  // namespace
}  // namespace mpf::test
