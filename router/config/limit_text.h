// SPDX-License-Identifier: MIT
// LimitText: the limits of a router by the names that they have in files ("queue-size") and as
// options ("--queue-size"), with units.
//
// Threads  plain data.
#pragma once

#include <string>
#include <vector>

#include "router/config/router_config.h"

namespace mpf::router {

// "500ms", "2s", "1min"; nothing without a unit.
//   throws  std::invalid_argument that says how it is written
[[nodiscard]] std::chrono::milliseconds parseTime(const std::string& text);

// "4096", "64KiB", "4MiB", "1GiB".
//   throws  std::invalid_argument that says how it is written
[[nodiscard]] std::uint64_t parseBytes(const std::string& text);

// Names of all limits.
[[nodiscard]] const std::vector<std::string>& limitNames();

// What it limits, and what it is written as: "SIZE".
[[nodiscard]] std::string limitPurpose(const std::string& name);
[[nodiscard]] std::string limitType(const std::string& name);

// Sets the limit `name`, one of limitNames(), to what `text` says.
//   throws  std::invalid_argument that says how it is written and within which bounds
void setLimit(Limits& limits, const std::string& name, const std::string& text);

// What setLimit() understands; with the largest unit that loses nothing.
[[nodiscard]] std::string limitText(const Limits& limits, const std::string& name);

}  // namespace mpf::router
