// SPDX-License-Identifier: MIT
// RouterArguments: the command line of mpf-router. Either a file contains the whole configuration,
// or options describe a simple one:
//
//   mpf-router /etc/mpf/router.toml
//   mpf-router --serve 1=0 --listen 10.0.0.7:9900 --plain
//   mpf-router --remote 1,2=ioc1.lab:9900
//     --tls-certificate our.pem --tls-key our.key --tls-authorities lab.pem
//
// Threads  one.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "router/config/written_config.h"

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
class Option;
}  // namespace CLI

namespace mpf::router {

class RouterArguments {
 public:
  // Parses the arguments and loads the configuration. Returns the exit status when the program must
  // exit: after --help, --version and --check, and after an error, which it has printed.
  [[nodiscard]] std::optional<int> start(int argc, const char* const* argv);

  // The descriptor of --ready-fd; -1: none.
  [[nodiscard]] int readyDescriptor() const noexcept { return readyDescriptor_; }
  // The configuration that start() has loaded.
  [[nodiscard]] const RouterConfig& config() const noexcept { return config_; }
  // Loads the configuration again from the current file, applies the options that override it, and
  // checks the TLS files.
  //   throws  ConfigError
  [[nodiscard]] RouterConfig loadConfig() const;

 private:
  // Adds the file and the options that replace it; returns these options.
  std::vector<CLI::Option*> addFile(CLI::App& app);
  void addOverrides(CLI::App& app);
  void applyTransport();

  std::string file_;  // empty: no file
  bool checkOnly_ = false;
  int readyDescriptor_ = -1;
  bool plain_ = false;
  std::string tlsName_;
  WrittenConfig options_;  // from the options that replace a file
  // Values of the options that override a file: for --log-level info, "info" under "log-level".
  std::map<std::string, std::string> overrides_;
  RouterConfig config_;
};

}  // namespace mpf::router
