// SPDX-License-Identifier: MIT
// SerialStartOptions: the command line of mpf-serial-server.
#pragma once

#include <optional>
#include <string>

#include <mpf/drivers/serial/serial_settings.h>
#include <mpf/server/programs/serial_server/serial_server.h>
#include <mpf/server/programs/server_arguments.h>

namespace mpf {

struct SerialStartOptions {
  std::string server;
  std::string port;  // a terminal device, or tcp:HOST:PORT
  bool wait = false;
  SerialSettings settings{9600, 1, 8, 'N', 'N'};
  SerialServerOptions serial;
  ServerArguments arguments;

  // The address when the port is one of a terminal server.
  [[nodiscard]] std::optional<std::string> tcpAddress() const;
  // "9600 baud, 8N1, no flow control"; of a terminal server's port, whose settings it keeps itself, "a terminal server".
  [[nodiscard]] std::string describeLine() const;
  // The exit status when the program shall end: --help, or a line that is wrong.
  std::optional<int> parse(int argc, char** argv);
};

}  // namespace mpf
