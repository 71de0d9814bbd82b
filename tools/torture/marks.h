// SPDX-License-Identifier: MIT
// Marks: where the steps (base/step.h) of this program are, from the notes of its own file. Forked
// children have them at the same addresses.
//
// Threads  any, once made.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace mpf::torture {

class Marks {
 public:
  using Address = std::uintptr_t;

  //   throws  std::runtime_error when the program's file cannot be read or has no steps
  static Marks ofThisProgram();

  // All, in alphabetical order. A step in an inline function is at several addresses.
  [[nodiscard]] const std::map<std::string, std::vector<Address>>& byName() const noexcept {
    return byName_;
  }
  [[nodiscard]] bool contains(const std::string& name) const { return byName_.contains(name); }
  // Name of the step at `address`; nullptr when there is none.
  [[nodiscard]] const std::string* find(Address address) const;

 private:
  std::map<std::string, std::vector<Address>> byName_;
  std::map<Address, std::string> byAddress_;
};

}  // namespace mpf::torture
