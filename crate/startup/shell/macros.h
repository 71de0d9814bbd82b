// SPDX-License-Identifier: MIT
// Macros of the iocsh dialect: $(NAME), ${NAME} and $(NAME=default).
//
// Threads  any.
// Trust    the depth and the length of the result are limited.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>

namespace mpf::startup {

// Returns `text` with its macros replaced by their values, which may contain macros themselves. A
// macro without a value and a default stays as it is.
//   undefined  out: the names of such macros
//   throws     LineError when the result is too long or nested too deep
[[nodiscard]] std::string expandMacros(std::string_view text,
                                       const std::map<std::string, std::string>& values,
                                       std::set<std::string>& undefined);

}  // namespace mpf::startup
