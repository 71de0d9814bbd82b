// SPDX-License-Identifier: MIT
#include "client/round.h"

#include <gtest/gtest.h>
#include <set>

namespace mpf::test {
namespace {

class RoundTest : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 2 * Round<int>::kPerStep + 1; ++i) all_.insert(std::make_shared<int>(0));
  }
  [[nodiscard]] int visits() const {
    int sum = 0;
    for (const auto& visited : all_) sum += *visited;
    return sum;
  }

  std::set<std::shared_ptr<int>> all_;
  Round<int> round_;
};

bool visit(int& visits) {
  ++visits;
  return true;
}

TEST_F(RoundTest, VisitsEachBindingOnceInSteps) {
  round_.begin({all_.begin(), all_.end()});

  round_.resume(visit);
  EXPECT_EQ(visits(), Round<int>::kPerStep);
  round_.resume(visit);
  EXPECT_FALSE(round_.isOver());
  round_.resume(visit);

  EXPECT_TRUE(round_.isOver());
  for (const auto& visited : all_) EXPECT_EQ(*visited, 1);
}

TEST_F(RoundTest, BindingsWithoutWorkDoNotCount) {
  round_.begin({all_.begin(), all_.end()});

  round_.resume([](int& visits) {
    ++visits;
    return false;
  });

  EXPECT_TRUE(round_.isOver());
  EXPECT_EQ(visits(), static_cast<int>(all_.size()));
}

TEST_F(RoundTest, SkipsBindingsThatWereDestroyed) {
  round_.begin({all_.begin(), all_.end()});
  while (all_.size() > 1) all_.erase(all_.begin());

  round_.resume(visit);

  EXPECT_TRUE(round_.isOver());
  EXPECT_EQ(visits(), 1);
}

TEST_F(RoundTest, ContinuesAfterABindingWhoseCallbackThrew) {
  round_.begin({all_.begin(), all_.end()});

  EXPECT_THROW(round_.resume([](int& visits) -> bool {
    ++visits;
    throw 1;
  }),
               int);
  while (!round_.isOver()) round_.resume(visit);

  for (const auto& visited : all_) EXPECT_EQ(*visited, 1);
}

TEST_F(RoundTest, ACallbackMayContinueTheRound) {
  round_.begin({all_.begin(), all_.end()});

  round_.resume([&](int& visits) {
    if (!round_.isOver()) round_.resume(visit);
    return visit(visits);
  });
  while (!round_.isOver()) round_.resume(visit);

  for (const auto& visited : all_) EXPECT_EQ(*visited, 1);
}

}  // namespace
}  // namespace mpf::test
