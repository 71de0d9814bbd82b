// SPDX-License-Identifier: MIT
// RouterArguments: the command line of mpf-router. A file says everything; without one, options
// make a simple router:
//
//   mpf-router /etc/mpf/router.toml
//   mpf-router --serve 1 --listen 10.0.0.7:9900 --plain
//   mpf-router --remote 1,2=ioc1.lab:9900 --tls-certificate our.pem --tls-key our.key
//   --tls-authorities lab.pem
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
  // Takes the arguments and loads the configuration. The exit status, when the program shall end:
  // after --help, --version and --check, and when something is wrong, which has been said by then.
  [[nodiscard]] std::optional<int> start(int argc, const char* const* argv);

  // Where to say that we listen; -1: nowhere.
  [[nodiscard]] int readyDescriptor() const noexcept { return readyDescriptor_; }
  // What start() loaded.
  [[nodiscard]] const RouterConfig& config() const noexcept { return config_; }
  // The same from the files as they are now: the configuration, with the options that go before it,
  // and those of TLS.
  //   throws  ConfigError
  [[nodiscard]] RouterConfig loadConfig() const;

 private:
  std::vector<CLI::Option*> addFile(CLI::App& app);  // and those options that stand in place of it
  void addOverrides(CLI::App& app);
  void takeTransport();

  std::string file_;  // empty: none
  bool checkOnly_ = false;
  int readyDescriptor_ = -1;
  bool plain_ = false;
  std::string tlsName_;
  WrittenConfig options_;  // what they say in place of a file
  std::map<std::string, std::string>
      overrides_;  // what they say whatever a file says: "info" of --log-level is under "log-level"
  RouterConfig config_;
};

}  // namespace mpf::router
