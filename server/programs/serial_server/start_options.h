// SPDX-License-Identifier: MIT
// SerialStartOptions: the command line of mpf-serial-server.
#pragma once

#include <optional>
#include <string>

#include <mpf/drivers/serial/serial_settings.h>
#include <mpf/server/message_server.h>
#include <mpf/server/programs/serial_server/serial_server.h>

namespace mpf {

struct SerialStartOptions {
  std::string server;
  std::string port;  // a terminal device, or tcp:HOST:PORT
  std::string backplane;
  bool wait = false;
  SerialSettings settings{9600, 1, 8, 'N', 'N'};
  SerialServerOptions serial;
  ServerOptions messages;

  // The exit status when the program shall end: --help, or a line that is wrong.
  std::optional<int> parse(int argc, char** argv);
};

}  // namespace mpf
