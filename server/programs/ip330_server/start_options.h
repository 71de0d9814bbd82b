// SPDX-License-Identifier: MIT
// Ip330StartOptions: the command line of mpf-ip330-server.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/ip330/ip330_settings.h"
#include "server/programs/hardware/hardware.h"
#include "server/programs/server_arguments.h"

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
}

namespace mpf {

struct Ip330StartOptions {
  struct Scan {
    std::string name;
    int first, last, averageMs, queueSize;
  };
  struct Config {
    std::string name;
    int queueSize;
  };
  struct Sweep {
    std::string name;
    int first, last, maxPoints, queueSize;
  };
  struct Pid {
    std::string name;
    int channel;
    std::string dac;
    int dacChannel, queueSize;
  };

  ModulePlace place;
  Ip330Settings settings;
  std::vector<Scan> scans;
  std::vector<Config> configs;
  std::vector<Sweep> sweeps;
  std::vector<Pid> pids;
  std::vector<ModulePlace> dacs;
  std::string signals;  // as parseIp330Signals()
  ServerArguments arguments;

  // Returns the exit status when the program is to exit: after --help or a usage error.
  std::optional<int> parse(int argc, char** argv, Hardware& hardware);

 private:
  void addBoard(CLI::App& app);
  void addServers(CLI::App& app);
  // Converts the texts below into settings. Throws std::invalid_argument.
  void takeAll();

  std::string type_ = "S";
  std::string range_ = "-5to5";
  int scanMode_ = 3;
  std::string trigger_ = "Input";
};

}  // namespace mpf
