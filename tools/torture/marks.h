// SPDX-License-Identifier: MIT
// Marks: the addresses of the steps (base/step.h) of this program, from the notes of its own file.
// Forked children have the steps at the same addresses.
//
// Threads  any, after construction.
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

  // All steps, in alphabetical order. A step in an inline function has several addresses.
  [[nodiscard]] const std::map<std::string, std::vector<Address>>& byName() const noexcept {
    return byName_;
  }
  [[nodiscard]] bool contains(const std::string& name) const { return byName_.contains(name); }
  // Name of the step at `address`; nullptr when no step is there.
  [[nodiscard]] const std::string* find(Address address) const;

 private:
  std::map<std::string, std::vector<Address>> byName_;
  std::map<Address, std::string> byAddress_;
};

}  // namespace mpf::torture
