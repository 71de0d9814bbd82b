// SPDX-License-Identifier: MIT
// Sabotage: mistakes made on purpose, each of which breaks one invariant. `mpf torture --break`
// with any of them must fail: a referee that never whistles proves nothing.
//
// Threads  the actor's.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

#include "tools/torture/actors.h"

namespace mpf::torture {

class Talk;

// The survivor's.
class Saboteur {
 public:
  Saboteur(Sabotage sabotage, std::string backplane)
      : sabotage_(sabotage), backplane_(std::move(backplane)) {}
  // Once a look; `rests`: the referee is looking.
  void meddle(Talk& mortal, bool rests);

 private:
  Sabotage sabotage_;
  std::string backplane_;
  bool rested_ = false;
  std::vector<FileDescriptor> leaked_;
};

// Forks a child that keeps this process's open files, and with them its locks, until the torture
// ends.
void leaveChildBehind(const World& world, const std::string& backplane);
// On each link of this process's clients: the next slot counts as complete, whatever it holds.
void publishHalfMessage(const std::string& backplane);

}  // namespace mpf::torture
