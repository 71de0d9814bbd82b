// SPDX-License-Identifier: MIT
// PolledSet: what a round polls.
#include "router/polled.h"

#include <array>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

// Adds itself in each poll().
struct Busy final : router::Polled {
  explicit Busy(router::PolledSet& of) : set(of) {}
  void poll() override {
    ++polls;
    if (victim != nullptr) set.remove(*victim);
    set.add(*this);
  }
  void setPolled(bool) override {}
  router::PolledSet& set;
  Busy* victim = nullptr;  // is removed while this one is polled
  int polls = 0;
};

TEST(PolledSet, PollsEachOnceInARound) {
  router::PolledSet set;
  std::array<Busy, 4> all{Busy(set), Busy(set), Busy(set), Busy(set)};
  for (auto& each : all) set.add(each);

  set.poll();

  for (const auto& each : all) EXPECT_EQ(each.polls, 1);
}

TEST(PolledSet, DoesNotPollOneThatIsRemovedInTheRound) {
  router::PolledSet set;
  Busy first(set);
  Busy second(set);
  first.victim = &second;
  set.add(first);
  set.add(second);

  set.poll();

  EXPECT_EQ(first.polls, 1);
  EXPECT_EQ(second.polls, 0);
}

}  // namespace
}  // namespace mpf::test
