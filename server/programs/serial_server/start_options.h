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

// One server, as the old initSerialServer had it.
struct SerialServerStart {
  std::string server;
  std::string port;  // that of an --octal-port, a terminal device, or tcp:HOST:PORT
  int queueSize = 20;
  SerialServerOptions serial = {};  // NOLINT(readability-redundant-member-init): g++ wants it
};

struct SerialStartOptions {
  std::vector<SerialServerStart> servers;  // one at least
  SerialSettings settings{9600, 1, 8, 'N', 'N'};  // of terminal devices
  OctalOptions octal;
  LineLimits limits;  // of all lines
  Hardware hardware;  // --carrier, --wait
  ServerArguments arguments;

  // "9600 baud, 8N1, no flow control"; of a terminal server's port, whose settings it keeps itself,
  // "a terminal server".
  [[nodiscard]] std::string describeLine(const std::string& port) const;
  // The exit status when the program shall end: --help, or a line that is wrong.
  std::optional<int> parse(int argc, char** argv);

 private:
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] bool hasTerminal() const;
};

// The address when the port is one of a terminal server.
[[nodiscard]] std::optional<std::string> tcpAddressOf(const std::string& port);

}  // namespace mpf
