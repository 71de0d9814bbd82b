// SPDX-License-Identifier: MIT
// ServerArguments: the options that all server programs have.
//
//   --backplane NAME   --location N   --wait-mode spin|adaptive|block   --mode 0660   --group NAME
//   --log-level info   --check
#pragma once

#include <string>

#include <mpf/message_server.h>

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
}

namespace mpf {

struct ServerArguments {
  std::string backplane;
  std::string logLevel = "info";
  ServerOptions messages;
  bool checkOnly = false;  // the program ends when all arguments are checked

  // Adds the options to `app`, which fills this object when it parses and must not outlive it. An
  // invalid value causes a CLI::ValidationError that names the valid values.
  void addTo(CLI::App& app);
  // Adds the optional argument `queuesize`, as the startup commands of the original MPF had it.
  void addQueueSizeTo(CLI::App& app);
};

}  // namespace mpf
