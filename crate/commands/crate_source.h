// SPDX-License-Identifier: MIT
// CrateSource: the file of a crate, which is a crate file or a startup file of the original MPF,
// and the options that change what it says.
//
// Threads  one.
#pragma once

#include <string>
#include <vector>

#include "base/toml/config_errors.h"
#include "crate/config/crate.h"
#include "crate/startup/commands/read_startup.h"

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
}

namespace mpf::crate {

class CrateSource {
 public:
  void addOptions(CLI::App& command);

  [[nodiscard]] const std::string& file() const noexcept { return file_; }
  [[nodiscard]] bool isStartupFile() const { return startup::isStartupFile(file_); }

  // Reads the crate.
  //   throws  ConfigError with all errors
  [[nodiscard]] Crate read() const;
  // The same, and checks that this host can start the processes of a crate file.
  [[nodiscard]] Crate check() const;
  // The same, and writes the commands for the IOC of a startup file into the folder of the crate,
  // which the caller has locked.
  [[nodiscard]] Crate prepare() const;
  // Reads a startup file.
  //   iocFile        where the commands for its IOC will be
  //   usesModels     device models replace the boards for which the user gave no carrier
  [[nodiscard]] startup::Startup readStartup(const std::string& iocFile, bool usesModels) const;

 private:
  [[nodiscard]] Crate readFile(ConfigErrors& errors) const;
  // The kinds of --carrier by name; "" is for all others.
  [[nodiscard]] std::map<std::string, std::string> carrierKinds() const;

  std::string file_;
  std::vector<std::string> carriers_, symbols_;
  std::string name_, address_;
};

// Prints warnings, and notes if `withNotes`, to stderr.
void printDiagnostics(const startup::Diagnostics& diagnostics, bool withNotes);

}  // namespace mpf::crate
