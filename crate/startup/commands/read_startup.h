// SPDX-License-Identifier: MIT
// readStartup(): executes a startup file of the original MPF, and returns the crate that it amounts
// to.
//
//   st.cmd ─► StartupShell ─► commands ─► StartupSite ─► Crate, file for mpf-ioc
//
// Threads  one.
#pragma once

#include <map>
#include <string>

#include "crate/config/crate.h"
#include "crate/startup/shell/diagnostics.h"

namespace mpf::startup {

struct StartupOptions {
  std::string crateName{};  // empty: the name of the folder of the file
  // Kinds of carriers by name, which replace the boards of the file; "" is for all others.
  std::map<std::string, std::string> carriers{};
  std::string address{};  // replaces the addresses of routers; empty: none
  std::map<std::string, std::string> symbols{};  // top, ip and others, as in cdCommands
  std::string iocFile{};  // where the caller writes Startup::iocText
};

struct Startup {
  crate::Crate crate;
  std::string iocText;  // empty: the file needs no IOC
  Diagnostics diagnostics;  // no errors
  int commands = 0;  // that are not of the shell; diagnostics.skipped() of them are not executed
};

//   throws  ConfigError with all errors, each with file, line and column
[[nodiscard]] Startup readStartup(const std::string& file, const StartupOptions& options);

// Whether the file is a startup file, and not a crate file (.toml).
[[nodiscard]] bool isStartupFile(const std::string& file);

}  // namespace mpf::startup
