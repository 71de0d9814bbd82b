// SPDX-License-Identifier: MIT
// Mischief: what a peer gone mad does to all that it may write: its link, the pools of the link,
// its own window, the other's hints.
//
// Threads  one.
// Crash    it is killed in the end.
// Trust    none.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "shm/endpoint.h"
#include "tests/support/random.h"

namespace mpf::test {

class Mischief {
 public:
  // `kind`: bytes, words, slots, hints, headers, cut, backwards.
  Mischief(const std::string& kind, OwnWindow& own, Random& random)
      : random_(random), kind_(kind), own_(own) {}

  // One deed, at `link`.
  void act(Link& link);
  // Looks for the files of `link` and of both ends again. Some have come, some were cut.
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
  std::uint64_t position_ = 0;  // where the other end reads, or near
};

}  // namespace mpf::test
