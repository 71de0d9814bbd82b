// SPDX-License-Identifier: MIT
// Boards: the carriers of a startup file. ipacAddCarrier() adds a board, which has a number;
// initIpacCarrier() gives the number a name. Commands of MPF R2 use the numbers.
//
//   ipacAddCarrier(&vipc616_01, "0x3000,0xa0000000")   board 0
//   initIpacCarrier("ipac0", 0)                        board 0 is the carrier "ipac0"
//
// Threads  one.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "crate/config/crate.h"

namespace mpf::startup {

struct Board {
  std::string kind;  // as --carrier takes it: "vipc616_01:0x3000,0xa0000000"; empty: a number only
  std::string place;
  std::string source;  // the line of the command
};

class Boards {
 public:
  // Returns its number.
  std::size_t add(Board board) {
    boards_.push_back(std::move(board));
    return boards_.size() - 1;
  }
  [[nodiscard]] std::size_t size() const noexcept { return boards_.size(); }
  // Returns whether the number has a board.
  [[nodiscard]] bool has(std::size_t number) const {
    return number < boards_.size() && !boards_[number].kind.empty();
  }
  // Returns false when the name belongs to another board.
  bool giveName(const std::string& name, std::size_t number) {
    return names_.emplace(name, number).first->second == number;
  }
  [[nodiscard]] bool hasName(const std::string& name) const { return names_.contains(name); }
  // The name of a board, which gets one if it has none: "carrier0".
  std::string nameOf(std::size_t number);

  // The carriers of a crate.
  //   kinds  kinds by name of carrier that replace those of the file; "" is for all others
  [[nodiscard]] std::vector<crate::Carrier> carriers(
      const std::map<std::string, std::string>& kinds) const;

 private:
  std::vector<Board> boards_;
  std::map<std::string, std::size_t> names_;
};

}  // namespace mpf::startup
