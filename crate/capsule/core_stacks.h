// SPDX-License-Identifier: MIT
// Reads a core with libdwfl.
//
// Threads  one.
// Trust    libdwfl checks what it reads, but is not made for hostile files: call these functions in
//          a process that may die.
#pragma once

#include <sys/types.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace mpf::crate {

// The pid in a core; nothing when the file is no core.
[[nodiscard]] std::optional<pid_t> pidOfCore(const std::string& file);

// "code", "address" and "threads" of describeCore().
//   throws  std::runtime_error that says what cannot be read
[[nodiscard]] nlohmann::ordered_json readCore(const std::string& file);

}  // namespace mpf::crate
