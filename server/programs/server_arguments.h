// SPDX-License-Identifier: MIT
// ServerArguments: the options that all server programs have.
//
//   --backplane NAME   --location N   --wait-mode spin|adaptive|block   --mode 0660   --group NAME
//   --log-level info
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

  // Adds the options to `app`, which fills this object when it parses and must not outlive it. A
  // value that is none is a CLI::ValidationError that says which values there are.
  void addTo(CLI::App& app);
  // Adds what old commands call queuesize, an argument that may be left out.
  void addQueueSizeTo(CLI::App& app);
};

}  // namespace mpf
