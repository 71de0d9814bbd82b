// SPDX-License-Identifier: MIT
// ShellState: what lines of startup files change in a shell.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>

#include "crate/startup/shell/value.h"

namespace mpf::startup {

struct ShellState {
  std::filesystem::path startFolder;
  std::filesystem::path folder;
  std::map<std::string, Value> symbols{{"NULL", Value()}};
  std::map<std::string, std::string> environment;
  std::size_t stringBytes = 0;  // written by strcpy(), strcat() and sprintf() so far
};

}  // namespace mpf::startup
