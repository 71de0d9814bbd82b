// SPDX-License-Identifier: MIT
// serveGhost: `mpf replay --as-server`.
#pragma once

#include <cstdint>
#include <string>

namespace mpf::tools {

struct GhostOptions {
  std::string file;
  std::string backplane;
  std::string server;  // empty: that of the recording
  std::int32_t location = 0;
  double speed = 1;
  bool json = false;
};

// Prints a line when the server has started, and a report at SIGINT or SIGTERM. Returns the exit
// status.
//   throws  as GhostScript and MessageServer
int serveGhost(const GhostOptions& options);

}  // namespace mpf::tools
