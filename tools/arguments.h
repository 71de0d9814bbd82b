// SPDX-License-Identifier: MIT
// Command-line arguments that several subcommands share, with the same names and help texts.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

namespace mpf::tools {

// Names the server that a subcommand uses.
struct ServerArguments {
  std::string backplane;
  std::optional<std::int32_t> location;  // empty: the user named none; see chosenLocation()
  std::string server;
};
void addServer(CLI::App& app, ServerArguments& arguments);
// --backplane; `backplane` stays empty when the user named none. `otherwise` is the default as the
// help text shows it.
void addBackplane(CLI::App& app, std::string& backplane, const std::string& otherwise);
// --location; `location` stays empty when the user named none.
void addLocation(CLI::App& app, std::optional<std::int32_t>& location);
// The location that the user named; otherwise $MPF_LOCATION, or 0. Called when a command runs: a
// variable that is wrong must not end the commands that do not use it, nor --help.
//   throws  std::invalid_argument when the variable is used, and is not a number
[[nodiscard]] std::int32_t chosenLocation(const std::optional<std::int32_t>& location);
void addJson(CLI::App& app, bool& json);

}  // namespace mpf::tools
