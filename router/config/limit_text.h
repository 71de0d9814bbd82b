// SPDX-License-Identifier: MIT
// The limits of a router as text, by their names in files ("queue-size") and as options
// ("--queue-size"), with units.
//
// Threads  any.
#pragma once

#include <string>
#include <vector>

#include "base/time_text.h"
#include "router/config/router_config.h"

namespace mpf::router {

// Parses "4096", "64KiB", "4MiB" or "1GiB".
//   throws  std::invalid_argument that shows the form
[[nodiscard]] std::uint64_t parseBytes(const std::string& text);

// The names of all limits.
[[nodiscard]] const std::vector<std::string>& limitNames();

// What the limit means, and the type of its value: "SIZE", "TIME" or "NUMBER".
[[nodiscard]] std::string limitPurpose(const std::string& name);
[[nodiscard]] std::string limitType(const std::string& name);

// Sets the limit `name`, one of limitNames(), to the value in `text`.
//   missing  of a time without a unit: an error in a file, seconds on a command line
//   throws   std::invalid_argument that shows the form or the range
void setLimit(Limits& limits, const std::string& name, const std::string& text,
              MissingUnit missing = MissingUnit::invalid);

// The value in the form that setLimit() reads, with the largest unit that divides it.
[[nodiscard]] std::string limitText(const Limits& limits, const std::string& name);

}  // namespace mpf::router
