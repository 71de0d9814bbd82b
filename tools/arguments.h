// SPDX-License-Identifier: MIT
// Command-line arguments that several subcommands share, with the same names and help texts.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace mpf::tools {

// Names the server that a subcommand uses.
struct ServerArguments {
  std::string backplane;
  std::int32_t location = 0;
  std::string server;
};
void addServer(CLI::App& app, ServerArguments& arguments);
// --backplane; `backplane` stays empty when the user named none. `otherwise` is the default as the
// help text shows it.
void addBackplane(CLI::App& app, std::string& backplane, const std::string& otherwise);
void addJson(CLI::App& app, bool& json);

}  // namespace mpf::tools
