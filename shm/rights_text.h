// SPDX-License-Identifier: MIT
// RightsText: who may open what a process creates, as people write it in options and
// configurations.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

namespace mpf {

// "0660": the owner reads and writes, others may.
//   throws  std::invalid_argument that names it and says what would be right
[[nodiscard]] mode_t parseMode(const std::string& text);

// The number of the group `name`.
//   throws  std::invalid_argument that names it
[[nodiscard]] std::uint32_t parseGroup(const std::string& name);

}  // namespace mpf
