// SPDX-License-Identifier: MIT
#include "tools/torture/actors.h"

#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <functional>

#include "tools/torture/checks.h"
#include "tools/torture/echo.h"
#include "tools/torture/sabotage.h"
#include "tools/torture/talk.h"

namespace mpf::torture {
namespace {

// Time between two reads of the board, and between two batches of requests.
constexpr auto kPace = std::chrono::microseconds(500);
constexpr std::uint64_t kVisit = 40;  // replies after which the visitor ends
constexpr std::uint64_t kStay = 8;    // replies after which a guest kills itself

WaitMode waitModeOf(std::uint32_t seed) {
  return seed % 2 == 0 ? WaitMode::adaptive : WaitMode::block;
}
bool byDescriptor(std::uint32_t seed) { return seed % 8 == 7; }

void runUntil(Dispatcher& dispatcher, const std::function<bool()>& isDone) {
  while (!isDone()) dispatcher.runOnce(Deadline::after(kPace));
}

// Unlike Backplane::attach(), this removes no stale segments: they are left for the process under
// test.
Backplane enter(const Cast& cast) { return Backplane::named(cast.backplane); }

}  // namespace

int playSurvivor(const Cast& cast) {
  Dispatcher dispatcher(enter(cast), {.waitMode = WaitMode::block, .label = "survivor"});
  auto& board = cast.world.survivor;
  Talk steady(dispatcher, cast.world, board.talked[0], "steady", cast.seed);
  Talk mortal(dispatcher, cast.world, board.talked[1], "mortal", cast.seed + 1);
  Saboteur saboteur(cast.sabotage, cast.backplane);
  while (board.leave.load() == 0) {
    const bool rests = board.rest.load() != 0;
    if (!rests) {
      steady.sendSome();
      mortal.sendSome();
    }
    const auto next = Deadline::after(kPace);  // leaves processor time to the process under test
    while (dispatcher.runOnce(next)) continue;
    board.open.store(steady.open() + mortal.open());
    board.isAtRest.store(rests && board.open.load() == 0 ? 1 : 0);
    saboteur.sabotage(mortal, rests);
  }
  return 0;
}

int playSteady(const Cast& cast) {
  Echo echo(enter(cast), "steady", cast.world, WaitMode::block);
  echo.run(cast.world.steady, false);
  return 0;
}

int playMortal(const Cast& cast) {
  Echo echo(Backplane::attach(cast.backplane), "mortal", cast.world, waitModeOf(cast.seed));
  auto& board = cast.world.mortal;
  board.incarnation.store(incarnationOf(cast.backplane, "mortal"));
  if (cast.sabotage == Sabotage::keepName) leaveChildBehind(cast.world, cast.backplane);
  echo.run(board, byDescriptor(cast.seed));
  board.isLeaving.store(1);
  return 0;
}

int playGuest(const Cast& cast) {
  Talked talked;
  Dispatcher dispatcher(enter(cast), {.label = "guest"});
  Talk mortal(dispatcher, cast.world, talked, "mortal", cast.seed);
  runUntil(dispatcher, [&] {
    mortal.sendSome();
    return talked.replies.load() >= kStay;
  });
  return ::raise(SIGKILL);
}

int playVisitor(const Cast& cast) {
  Talked ofAbsent;
  Talked ofFleeting;
  auto& board = cast.world.visitor;
  auto& ofSteady = board.talked[0];
  const auto repliesBefore = ofSteady.replies.load();
  Dispatcher dispatcher(Backplane::attach(cast.backplane),
                        {.waitMode = waitModeOf(cast.seed), .label = "visitor"});
  {
    const Talk absent(dispatcher, cast.world, ofAbsent, "absent", cast.seed);
    Talk steady(dispatcher, cast.world, ofSteady, "steady", cast.seed + 1);
    Talk fleeting(dispatcher, cast.world, ofFleeting, "fleeting", cast.seed + 2);
    runUntil(dispatcher, [&] {
      steady.sendSome();
      if (ofFleeting.replies.load() < kStay) fleeting.sendSome();
      return ofSteady.replies.load() - repliesBefore >= kVisit &&
             ofFleeting.replies.load() >= kStay;
    });
    if (cast.sabotage == Sabotage::halfMessage) publishHalfMessage(cast.backplane);
    bool isDying = false;
    runUntil(dispatcher, [&] {
      isDying = isDying || fleeting.trySendDie();
      board.open.store(steady.open() + fleeting.open());
      return ofFleeting.disconnects.load() != 0 && board.open.load() == 0;
    });
    board.isLeaving.store(1);
  }
  return 0;
}

int playFleeting(const Cast& cast) {
  Echo echo(enter(cast), "fleeting", cast.world, WaitMode::adaptive);
  const Board neverLeave;
  echo.run(neverLeave, false);
  return 0;
}

int playCorpse(const Cast& cast) {
  const auto backplane = enter(cast);
  Talked talked;
  Talked ofAbsent;
  Echo echo(backplane, "corpse", cast.world, WaitMode::adaptive);
  Dispatcher dispatcher(backplane, {.label = "corpse"});
  Talk talk(dispatcher, cast.world, talked, "corpse", cast.seed);
  const Talk absent(dispatcher, cast.world, ofAbsent, "absent", cast.seed);
  while (talked.replies.load() < kVisit) {
    talk.sendSome();
    dispatcher.runOnce(Deadline::atNs(0));
    echo.handleAll();
  }
  return ::raise(SIGKILL);
}

}  // namespace mpf::torture
