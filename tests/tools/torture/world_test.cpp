// SPDX-License-Identifier: MIT
#include "tools/torture/world.h"

#include <sys/wait.h>

#include <gtest/gtest.h>
#include <memory>

#include "base/system_call.h"

namespace mpf::torture {
namespace {

constexpr std::int32_t kValues = 65536;  // that the world remembers

TEST(World, KeepsTheFirstComplaint) {
  const auto world = std::make_unique<World>();
  EXPECT_EQ(world->complaint(), "");

  world->complain("first");
  world->complain("second");

  EXPECT_EQ(world->complaint(), "first");
}

TEST(World, CutsALongComplaint) {
  const auto world = std::make_unique<World>();

  world->complain(std::string(1000, 'x'));

  EXPECT_EQ(world->complaint(), std::string(255, 'x'));
}

TEST(World, GivesEachRequestAValueOfItsOwn) {
  const auto world = std::make_unique<World>();

  const auto first = world->nextValue();

  EXPECT_NE(first, 0) << "the initial value of each entry";
  EXPECT_NE(world->nextValue(), first);
}

TEST(World, AcceptsRequestsThatWereHandledOrNeverTaken) {
  const auto world = std::make_unique<World>();

  world->noteHandled(1);
  world->noteNeverTaken(2);
  world->noteHandled(3);

  EXPECT_EQ(world->complaint(), "");
}

TEST(World, ComplainsOfARequestThatWasHandledTwice) {
  const auto world = std::make_unique<World>();
  world->noteHandled(7);

  world->noteHandled(7);

  EXPECT_EQ(world->complaint(), "a server acted twice on a request");
}

TEST(World, ComplainsOfARequestThatWasHandledAndNeverTaken) {
  const auto earlier = std::make_unique<World>();
  earlier->noteNeverTaken(7);
  earlier->noteHandled(7);
  EXPECT_EQ(earlier->complaint(),
            "a server acted on a request that had been reported as never taken");

  const auto later = std::make_unique<World>();
  later->noteHandled(7);
  later->noteNeverTaken(7);
  EXPECT_EQ(later->complaint(),
            "a request was reported as never taken, but a server had acted on it");
}

// Two values that share an entry are different requests.
TEST(World, DoesNotConfuseValuesThatShareAnEntry) {
  const auto world = std::make_unique<World>();

  world->noteHandled(7);
  world->noteHandled(7 + kValues);
  world->noteNeverTaken(7);
  world->noteHandled(-1);
  world->noteNeverTaken(kValues - 1);

  EXPECT_EQ(world->complaint(), "");
}

TEST(Board, IsClearedExceptForTheCounts) {
  Board board;
  for (auto* word : {&board.rest, &board.leave, &board.isAtRest, &board.isLeaving}) word->store(1);
  board.open.store(5);
  board.talked[1].replies.store(9);

  board.clear();

  for (const auto* word : {&board.rest, &board.leave, &board.isAtRest, &board.isLeaving})
    EXPECT_EQ(word->load(), 0U);
  EXPECT_EQ(board.open.load(), 0U);
  EXPECT_EQ(board.talked[1].replies.load(), 9U);
}

TEST(SharedWorld, IsTheSameInAForkedProcess) {
  const SharedWorld world;
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    (*world).noteHandled(11);
    (*world).complain("from the child");
    ::_exit((*world).referee == ::getppid() ? 0 : 1);
  }
  int status = -1;
  checkCall(::waitpid(child, &status, 0), "waitpid");

  EXPECT_EQ(status, 0) << "the referee is the process that made the world";
  EXPECT_EQ((*world).complaint(), "from the child");
}

}  // namespace
}  // namespace mpf::torture
