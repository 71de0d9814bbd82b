// SPDX-License-Identifier: MIT
// FanOutLoans: what one client holds, returns and misses.
#include "shm/fan_out_loans.h"

#include <optional>

#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class FanOutLoansTest : public ShmTest {
 protected:
  static constexpr std::size_t kBytes = 100'000;

  void TearDown() override {
    pool_.reset();
    ShmTest::TearDown();
  }
  std::optional<FanOutPool> pool_{std::in_place, name(), 0xabcu, Rights{}, std::uint64_t{1} << 24};
};

TEST_F(FanOutLoansTest, OnlyWhatIsHeldCanBeReturnedAndOnlyOnce) {
  const auto chunk = pool_->tryAlloc(kBytes);
  const auto other = pool_->tryAlloc(kBytes);
  FanOutLoans loans;
  ASSERT_TRUE(loans.tryLend(chunk));

  loans.takeBack(other->number());
  loans.takeBack(77);
  EXPECT_EQ(loans.count(), 1u);
  loans.takeBack(chunk->number());
  loans.takeBack(chunk->number());

  EXPECT_EQ(loans.count(), 0u);
  chunk->drop();
  EXPECT_EQ(pool_->tryAlloc(kBytes), chunk) << "the program was its last holder";
}

TEST_F(FanOutLoansTest, AChunkMayBeLentTwiceToTheSameClient) {
  const auto chunk = pool_->tryAlloc(kBytes);
  FanOutLoans loans;
  ASSERT_TRUE(loans.tryLend(chunk) && loans.tryLend(chunk));
  chunk->drop();

  loans.takeBack(chunk->number());
  EXPECT_NE(pool_->tryAlloc(kBytes), chunk);
  loans.takeBack(chunk->number());

  EXPECT_EQ(pool_->tryAlloc(kBytes), chunk);
}

TEST_F(FanOutLoansTest, AKilledClientHasReturnedEverythingAndALivingOneRetiresIt) {
  const auto ended = pool_->tryAlloc(kBytes);
  const auto retired = pool_->tryAlloc(kBytes);
  {
    FanOutLoans killed;
    FanOutLoans living;
    ASSERT_TRUE(killed.tryLend(ended) && living.tryLend(retired));
    ended->drop();
    retired->drop();
    killed.endAll();
  }

  EXPECT_EQ(pool_->tryAlloc(kBytes), ended);
  EXPECT_FALSE(segments::exists(retired->segment().name()));
}

TEST_F(FanOutLoansTest, CountsMissedMessagesForEachRequest) {
  FanOutLoans loans;
  for (int i = 0; i < 3; ++i) loans.noteMissed(5);
  loans.noteMissed(6);

  EXPECT_EQ(loans.missed(5), 3u);
  EXPECT_EQ(loans.missed(7), 0u);
  loans.forgetMissed(5);

  EXPECT_EQ(loans.missed(5), 0u);
  EXPECT_EQ(loans.missed(6), 1u);
}

TEST_F(FanOutLoansTest, RemembersABoundedNumberOfRequests) {
  FanOutLoans loans;
  for (std::uint32_t request = 0; request < 100'000; ++request) loans.noteMissed(request);

  EXPECT_EQ(loans.missed(99'999), 1u);
  EXPECT_EQ(loans.missed(0), 0u);
}

}  // namespace
}  // namespace mpf::test
