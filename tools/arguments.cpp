// SPDX-License-Identifier: MIT
#include "tools/arguments.h"

#include <mpf/backplane.h>

namespace mpf::tools {

void addBackplane(CLI::App& app, std::string& backplane, const std::string& otherwise) {
  app.add_option("--backplane", backplane, "Backplane; default: $MPF_BACKPLANE, or " + otherwise)
      ->envname("MPF_BACKPLANE");
}

void addServer(CLI::App& app, ServerArguments& arguments) {
  addBackplane(app, arguments.backplane, "\"default\"");
  addLocation(app, arguments.location);
  app.add_option("server", arguments.server, "Name of the server")->required();
}

void addLocation(CLI::App& app, std::optional<std::int32_t>& location) {
  app.add_option("--location", location, "Location of the server; default: $MPF_LOCATION, or 0");
}

std::int32_t chosenLocation(const std::optional<std::int32_t>& location) {
  return location ? *location : Backplane::defaultLocation();
}

void addJson(CLI::App& app, bool& json) {
  app.add_flag("--json", json, "Print JSON, for programs");
}

}  // namespace mpf::tools
