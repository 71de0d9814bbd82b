// SPDX-License-Identifier: MIT
// Sabotage: mistakes made on purpose, each of which breaks one invariant. `mpf torture --break`
// must fail with each of them, which shows that the referee detects defects.
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

// Makes the mistakes of the survivor.
class Saboteur {
 public:
  Saboteur(Sabotage sabotage, std::string backplane)
      : sabotage_(sabotage), backplane_(std::move(backplane)) {}
  // Called in each turn of the survivor's loop. `rests`: the referee has asked for a rest, in which
  // it runs its checks.
  void sabotage(Talk& mortal, bool rests);

 private:
  Sabotage sabotage_;
  std::string backplane_;
  bool rested_ = false;
  std::vector<FileDescriptor> leaked_;
};

// Forks a child that keeps the open files of this process, and with them its locks, until the
// referee has finished.
void leaveChildBehind(const World& world, const std::string& backplane);
// On each link of this process's clients, marks the next slot as published without writing it.
void publishHalfMessage(const std::string& backplane);

}  // namespace mpf::torture
