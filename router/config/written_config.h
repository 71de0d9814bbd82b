// SPDX-License-Identifier: MIT
// WrittenConfig: a configuration, and where its parts were written, so that errors found later
// begin with file and line, too.
//
//   readConfig(FILE) ─┐
//   options ──────────┴─► WrittenConfig ─► completeConfig() ─► RouterConfig
//
// Threads  plain data.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "router/config/router_config.h"

namespace mpf::router {

// Where each key of a table was written, as an error about it begins: "FILE:LINE" or "--listen".
// Under "": the table itself.
struct Places : std::map<std::string, std::string> {
  using map::map;

  // Of `key`, or of the table when it is not there.
  [[nodiscard]] const std::string& of(const std::string& key) const {
    const auto found = find(key);
    return found != end() ? found->second : at("");
  }
};

struct ConfigPlaces {
  bool isFile = true;
  Places root, tls, limits;
  std::vector<Places> serve, listen, remotes, allow;  // one for each of the configuration's

  // How an entry is written.
  [[nodiscard]] std::string entry(const std::string& name) const {
    return isFile ? "[[" + name + "]]" : "--" + name;
  }
};

struct WrittenConfig {
  RouterConfig config;
  ConfigPlaces places;
};

// Reads a TOML file, and checks each value by itself.
//   throws  ConfigError
[[nodiscard]] WrittenConfig readConfig(const std::string& file);

// Fills in defaults that depend on other values; checks that all values together make sense, and
// that the files of TLS are there.
//   throws  ConfigError
void completeConfig(WrittenConfig& written);

}  // namespace mpf::router
