// SPDX-License-Identifier: MIT
// Arguments that several subcommands have, under the same names and with the same texts.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include <mpf/clock.h>

namespace mpf::tools {

// Where the server of a subcommand is.
struct ServerArguments {
  std::string backplane;
  std::int32_t location = 0;
  std::string server;
};
void addServer(CLI::App& app, ServerArguments& arguments);
// --backplane; empty: none was named.
void addBackplane(CLI::App& app, std::string& backplane, const std::string& otherwise);
void addJson(CLI::App& app, bool& json);
// A time in seconds that is shown with its default; 0 only if that means something.
void addSeconds(CLI::App& app, const std::string& name, double& seconds, const std::string& text,
                bool mayBeZero);
[[nodiscard]] Nanoseconds ofSeconds(double seconds);

}  // namespace mpf::tools
