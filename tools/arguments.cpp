// SPDX-License-Identifier: MIT
#include "tools/arguments.h"

#include <fmt/format.h>

#include <mpf/backplane.h>

namespace mpf::tools {

void addBackplane(CLI::App& app, std::string& backplane, const std::string& otherwise) {
  app.add_option("--backplane", backplane, "Backplane; default: $MPF_BACKPLANE, or " + otherwise)
      ->envname("MPF_BACKPLANE");
}

void addServer(CLI::App& app, ServerArguments& arguments) {
  addBackplane(app, arguments.backplane, "\"default\"");
  arguments.location = Backplane::defaultLocation();
  app.add_option("--location", arguments.location,
                 "Location of the server; default: $MPF_LOCATION, or 0");
  app.add_option("server", arguments.server, "Name of the server")->required();
}

void addJson(CLI::App& app, bool& json) {
  app.add_flag("--json", json, "Print JSON, for programs");
}

void addSeconds(CLI::App& app, const std::string& name, double& seconds, const std::string& text,
                bool mayBeZero) {
  const auto check = [mayBeZero](const std::string& word) {
    constexpr double kMost = 1e9;
    double value = 0;
    const bool good = CLI::detail::lexical_cast(word, value) && value <= kMost &&
                      (mayBeZero ? value >= 0 : value > 0);
    return good ? std::string()
                : fmt::format("{} is not a time: use a number of seconds {} to 1e9", word,
                              mayBeZero ? "from 0" : "above 0");
  };
  app.add_option(name, seconds, text)->capture_default_str()->type_name("SECONDS")->check(check);
}

Nanoseconds ofSeconds(double seconds) {
  return Nanoseconds(static_cast<std::int64_t>(seconds * 1e9));
}

}  // namespace mpf::tools
