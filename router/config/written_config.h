// SPDX-License-Identifier: MIT
// WrittenConfig: a configuration together with the places at which its values are written, so that
// errors that are found later also begin with the file and the line.
//
//   readConfig(FILE) ─┐
//   options ──────────┴─► WrittenConfig ─► completeConfig() ─► RouterConfig
//
// Threads  plain data.
#pragma once

#include <string>
#include <vector>

#include "router/config/router_config.h"

namespace mpf::router {

struct ConfigPlaces {
  bool isFile = true;
  Places root, tls, limits;
  std::vector<Places> serve, listen, remotes, allow;  // one for each entry of the configuration

  // The written form of an entry: "[[listen]]" in a file, or "--listen".
  [[nodiscard]] std::string entry(const std::string& name) const {
    return isFile ? "[[" + name + "]]" : "--" + name;
  }
};

struct WrittenConfig {
  RouterConfig config;
  ConfigPlaces places;
};

// Reads a TOML file and checks each value by itself.
//   throws  ConfigError
[[nodiscard]] WrittenConfig readConfig(const std::string& file);

// Fills in defaults that depend on other values, checks that the values fit together, and checks
// the TLS files.
//   throws  ConfigError
void completeConfig(WrittenConfig& written);

}  // namespace mpf::router
