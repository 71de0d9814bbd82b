// SPDX-License-Identifier: MIT
// SegmentWitness: which segments are open, before and after a death.
#include "crate/capsule/segment_witness.h"

#include "tests/crate/capsule/crash_fixture.h"

namespace mpf::crate::test {
namespace {

class SegmentWitnessTest : public CrashTest {};

TEST_F(SegmentWitnessTest, KeepsTheSegmentsOfADeadServer) {
  start();
  EXPECT_EQ(witness_.files(), 2u) << "window and link";
  server_.end(SIGKILL);
  while (client_->isConnected()) step();

  witness_.look();

  EXPECT_EQ(witness_.files(), 2u);
  witness_.forget(pid_);
  EXPECT_EQ(witness_.files(), 0u);
  EXPECT_EQ(witness_.find(pid_), nullptr);
}

TEST_F(SegmentWitnessTest, GivesUpLinksThatWereClosedWhileTheServerLives) {
  start();

  client_.reset();
  while (!backplane_.segmentNames().empty() && witness_.files() != 1) witness_.look();

  EXPECT_EQ(witness_.files(), 1u) << "the window";
}

TEST_F(SegmentWitnessTest, IgnoresAnEarlierProcessWithThisPid) {
  start();

  witness_.watch(pid_, 1);
  witness_.look();

  EXPECT_EQ(witness_.files(), 0u);
}

TEST_F(SegmentWitnessTest, GivesUpTheOldestLinkAtItsLimit) {
  start();
  SegmentWitness small(backplane_.name(), 2);
  small.watch(pid_, startTicksOfVictim(pid_));
  MessageClient second(dispatcher_, [](Message&&) {});
  second.bind("victim");
  while (!second.isConnected()) step();

  small.look();

  EXPECT_LE(small.files(), 2u);
}

}  // namespace
}  // namespace mpf::crate::test
