// SPDX-License-Identifier: MIT
// Attacker: writes invalid data to everything that a peer may write: its link, the pools of the
// link, its own window and the hints of the other side.
//
// Threads  one thread.
// Crash    the test kills the process at the end.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "shm/endpoint.h"
#include "tests/support/random.h"

namespace mpf::test {

class Attacker {
 public:
  // `kind` is bytes, words, slots, hints, headers, cut or backwards.
  Attacker(const std::string& kind, OwnWindow& own, Random& random)
      : random_(random), kind_(kind), own_(own) {}

  // Performs one attack on `link`.
  void act(Link& link);
  // Maps the files of `link` and of both ends again: files may be new, or may have been truncated.
  void reach(const Link& link);

 private:
  struct File {
    std::string path;
    Mapping memory;
  };
  void open(const std::string& name);
  [[nodiscard]] Mapping& any() { return files_[random_.below(files_.size())].memory; }
  void writeByte();
  void writeWord();
  void writeSlot(Link& link);
  void writeHints();
  void writeHeader();
  void cut();
  void goBack(Link& link);

  Random& random_;
  std::string kind_;
  OwnWindow& own_;
  std::vector<File> files_;
  std::uint64_t position_ = 0;  // near the position at which the other end reads
};

}  // namespace mpf::test
