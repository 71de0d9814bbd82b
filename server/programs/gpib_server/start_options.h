// SPDX-License-Identifier: MIT
// GpibStartOptions: the command line of mpf-gpib-server.
#pragma once

#include <optional>
#include <string>

#include "server/programs/gpib_server/gpib_request.h"
#include "server/programs/gpib_server/ti9914_options.h"
#include "server/programs/hardware/hardware.h"
#include "server/programs/server_arguments.h"

namespace mpf {

struct GpibStartOptions {
  std::string server;
  std::string module;  // name of a --ti9914 module, or the text of another controller
  GpibLimits limits;
  Ti9914Options ti9914;
  Hardware hardware;  // --carrier, --wait
  ServerArguments arguments;

  // Returns the exit status when the program is to exit: after --help or a usage error.
  std::optional<int> parse(int argc, char** argv);
};

}  // namespace mpf
