// SPDX-License-Identifier: MIT
// Actors: what each process of a torture does, from its fork to its exit status.
//
//   survivor ─┬─► steady      these two go on
//             └─► mortal ◄─ guest      a server that is tormented, and a client of it that kills itself
//   visitor ──┬─► steady      a client that is tormented
//             ├─► fleeting    a server that kills itself when the visitor asks it to
//             └─► absent      a server that never comes
//   corpse                    left everything that a dead process can leave, for whoever attaches
//                             next
#pragma once

#include <cstdint>
#include <string>

#include "tools/torture/world.h"

namespace mpf::torture {

// What goes wrong on purpose, so that one sees the referee notice it.
enum class Sabotage {
  none,
  loseFate,  // the survivor forgets to count an end
  halfMessage,  // the visitor makes a message visible that it has not written
  keepName,  // the mortal server's lock outlives it
  stale,  // the survivor leaves a file
  leak,  // the survivor opens a descriptor more in each round
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
