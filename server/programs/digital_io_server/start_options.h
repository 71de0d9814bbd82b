// SPDX-License-Identifier: MIT
// DigitalIoStartOptions: the command line of mpf-digital-io-server.
#pragma once

#include <optional>
#include <string>

#include "drivers/digital_io/digital_io.h"
#include "server/programs/hardware/hardware.h"
#include "server/programs/hardware/wire_options.h"
#include "server/programs/server_arguments.h"

namespace mpf {

struct DigitalIoStartOptions {
  ModulePlace place;
  DigitalIoOptions io;
  const DigitalIoKind* kind = nullptr;  // of a model; never null after parse()
  InputWires inputs;                    // of a model
  int maxClients = 0;                   // of old command lines; ignored
  ServerArguments arguments;

  // Returns the exit status when the program is to exit: after --help or a usage error.
  std::optional<int> parse(int argc, char** argv, Hardware& hardware);
};

}  // namespace mpf
