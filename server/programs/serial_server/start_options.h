// SPDX-License-Identifier: MIT
// SerialStartOptions: the command line of mpf-serial-server.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <mpf/drivers/serial/serial_settings.h>

#include "server/programs/hardware/hardware.h"
#include "server/programs/serial_server/octal_options.h"
#include "server/programs/serial_server/serial_server.h"
#include "server/programs/server_arguments.h"

namespace mpf {

// The parameters of one server, as in the old initSerialServer.
struct SerialServerStart {
  std::string server;
  std::string port;  // name of an --octal-port, terminal device, or tcp:HOST:PORT
  int queueSize = 20;
  SerialServerOptions serial = {};
};

struct SerialStartOptions {
  std::vector<SerialServerStart> servers;  // one at least
  SerialSettings settings{9600, 1, 8, 'N', 'N'};  // of terminal devices
  OctalOptions octal;
  LineLimits limits;  // of all lines
  Hardware hardware;  // --carrier, --wait
  ServerArguments arguments;

  // "9600 baud, 8N1, no flow control"; "a terminal server" for the port of a terminal server, which
  // keeps its own settings.
  [[nodiscard]] std::string describeLine(const std::string& port) const;
  // Returns the exit status when the program is to exit: after --help or a usage error.
  std::optional<int> parse(int argc, char** argv);

 private:
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] bool hasTerminal() const;
};

// Returns HOST:PORT of the port of a terminal server; nullopt for other ports.
[[nodiscard]] std::optional<std::string> tcpAddressOf(const std::string& port);

}  // namespace mpf
