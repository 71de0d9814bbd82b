// SPDX-License-Identifier: MIT
#include "base/bias.h"

#include <gtest/gtest.h>
#include <thread>

namespace mpf {
namespace {

class BiasTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!expedited_barrier::tryRegister()) GTEST_SKIP() << "no membarrier() here";
  }
  // The number of entries by the real lock until the bias is enabled, or `most`.
  int enterUntilEnabled(int most) {
    for (int entries = 1; entries <= most; ++entries) {
      bias_.noteEntry();
      if (bias_.tryEnter()) {
        bias_.leave();
        return entries;
      }
    }
    return most;
  }
  template <class Act>
  static void inAnotherThread(const Act& act) {
    std::thread(act).join();
  }

  Bias bias_;
};

constexpr int kFew = 2;
constexpr int kMany = 10'000;

TEST_F(BiasTest, IsEnabledForAThreadThatEntersOftenInARow) {
  EXPECT_FALSE(bias_.tryEnter());
  EXPECT_GT(enterUntilEnabled(kMany), kFew);

  EXPECT_TRUE(bias_.tryEnter());
  EXPECT_TRUE(bias_.isMine());
  bias_.leave();

  EXPECT_FALSE(bias_.isMine());
  inAnotherThread([&] {
    EXPECT_TRUE(bias_.isOfAnotherThread());
    EXPECT_FALSE(bias_.tryEnter());
  });
}

TEST_F(BiasTest, IsNotEnabledForThreadsThatTakeTurns) {
  for (int i = 0; i < 1000; ++i) {
    bias_.noteEntry();
    inAnotherThread([&] { bias_.noteEntry(); });
  }

  EXPECT_FALSE(bias_.tryEnter());
}

TEST_F(BiasTest, AnotherThreadDisablesItAndSeesWhetherTheOwnerIsInside) {
  ASSERT_LT(enterUntilEnabled(kMany), kMany);
  EXPECT_TRUE(bias_.disable()) << "the owner has nothing to disable";
  ASSERT_TRUE(bias_.tryEnter());

  inAnotherThread([&] { EXPECT_FALSE(bias_.disable()) << "the owner is inside"; });
  EXPECT_TRUE(bias_.isMine()) << "until it leaves";
  bias_.leave();

  EXPECT_FALSE(bias_.tryEnter());
  inAnotherThread([&] { EXPECT_TRUE(bias_.disable()); });
}

TEST_F(BiasTest, IsEnabledAgainForTheSameThreadOnly) {
  ASSERT_LT(enterUntilEnabled(kMany), kMany);
  inAnotherThread([&] {
    EXPECT_TRUE(bias_.disable());
    EXPECT_EQ(enterUntilEnabled(kMany), kMany);
  });

  EXPECT_LT(enterUntilEnabled(kMany), kMany);
}

}  // namespace
}  // namespace mpf
