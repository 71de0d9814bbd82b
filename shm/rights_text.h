// SPDX-License-Identifier: MIT
// RightsText: parses file modes and group names from options and configuration files, for Rights
// (<mpf/rights.h>), and checks the rights that a program gives.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

#include <mpf/rights.h>

namespace mpf {

// Parses an octal mode from "0600" to "0666". The owner must have read and write permission.
//   throws  std::invalid_argument that names the text and the valid values
[[nodiscard]] mode_t parseMode(const std::string& text);

// Returns the rights of a server if they are valid.
//   throws  std::invalid_argument that names the invalid value and the valid ones
Rights checkServerRights(const Rights& rights);

// Returns the number of the group `name`.
//   throws  std::invalid_argument that names the group if it does not exist
[[nodiscard]] std::uint32_t parseGroup(const std::string& name);

}  // namespace mpf
