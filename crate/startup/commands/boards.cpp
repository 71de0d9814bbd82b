// SPDX-License-Identifier: MIT
#include "crate/startup/commands/boards.h"

#include <fmt/format.h>

namespace mpf::startup {

std::string Boards::nameOf(std::size_t number) {
  for (const auto& [name, named] : names_)
    if (named == number) return name;
  auto name = fmt::format("carrier{}", number);
  while (!giveName(name, number)) name += '_';
  return name;
}

std::vector<crate::Carrier> Boards::carriers(
    const std::map<std::string, std::string>& kinds) const {
  std::vector<crate::Carrier> carriers;
  for (const auto& [name, number] : names_) {
    const auto& board = boards_[number];
    auto replaced = kinds.find(name);
    if (replaced == kinds.end()) replaced = kinds.find("");
    carriers.push_back(
        {name, replaced != kinds.end() ? replaced->second : board.kind, board.place, board.source});
  }
  return carriers;
}

}  // namespace mpf::startup
