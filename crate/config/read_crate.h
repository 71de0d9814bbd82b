// SPDX-License-Identifier: MIT
// readCrate(): reads a crate file and checks it. All errors are reported at once.
//
// Threads  one.
#pragma once

#include <map>
#include <string>

#include "base/toml/config_errors.h"
#include "crate/config/crate.h"

namespace mpf::crate {

//   throws  ConfigError with all errors, each with file, line and column
[[nodiscard]] Crate readCrate(const std::string& file);
// The same, but adds the errors to `errors`.
//   throws  ConfigError when the file cannot be read, is not TOML, or has a text with NUL
[[nodiscard]] Crate readCrate(const std::string& file, ConfigErrors& errors);

// Checks what concerns several entries: names that are used twice, needs that form a circle,
// modules that two processes drive, unknown carriers, missing values. Sets Process::isSound.
void checkCrate(Crate& crate, ConfigErrors& errors);

// Refuses names of carriers that the crate does not have: a misspelt one would replace nothing.
//   kinds  kinds by name, as --carrier gives them; "" is for all carriers
void checkCarrierNames(const Crate& crate, const std::map<std::string, std::string>& kinds,
                       ConfigErrors& errors);

// Names of crates and processes are names of folders and files. Returns what is wrong with one;
// empty: nothing.
[[nodiscard]] std::string problemOfName(const std::string& name);

// Parses "500ms", "2s" or "1.5min".
//   throws  std::invalid_argument that shows the form
[[nodiscard]] std::chrono::milliseconds parseDuration(const std::string& text);
// The same, or "off" (0).
[[nodiscard]] std::chrono::milliseconds parseDurationOrOff(const std::string& text);

}  // namespace mpf::crate
