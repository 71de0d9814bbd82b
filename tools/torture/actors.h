// SPDX-License-Identifier: MIT
// Actors: the processes of `mpf torture`. Each function runs from the fork of its process to its
// exit status.
//
//   survivor ─┬─► steady           these two are never killed
//             └─► mortal ◄─ guest  the server under test, and a client of it that kills itself
//   visitor ──┬─► steady           the client under test
//             ├─► fleeting         a server that kills itself when the visitor asks it to
//             └─► absent           a server that is never started
//   corpse                         dies and leaves everything that a dead process can leave; the
//                                  next process that attaches removes it
#pragma once

#include <cstdint>
#include <string>

#include "tools/torture/world.h"

namespace mpf::torture {

// Mistakes that an actor makes on purpose, to show that the referee detects them.
enum class Sabotage {
  none,
  loseFate,     // the survivor ignores the fate of a request
  halfMessage,  // the visitor publishes a message that it has not written
  keepName,     // the lock of the mortal server outlives it
  stale,        // the survivor leaves a stale link
  leak,         // the survivor opens another descriptor in each round
};

struct Cast {
  World& world;
  std::string backplane;
  std::uint32_t seed = 0;  // of this actor
  Sabotage sabotage = Sabotage::none;
};

int playSurvivor(const Cast& cast);
int playSteady(const Cast& cast);
int playMortal(const Cast& cast);
int playGuest(const Cast& cast);
int playVisitor(const Cast& cast);
int playFleeting(const Cast& cast);
int playCorpse(const Cast& cast);

}  // namespace mpf::torture
