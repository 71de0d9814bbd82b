// SPDX-License-Identifier: MIT
#include <mpf/server/programs/serial_server/start_options.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <string_view>

#include <mpf/schema/text.h>

namespace mpf {

std::optional<std::string> SerialStartOptions::tcpAddress() const {
  constexpr std::string_view kTcp = "tcp:";
  return port.starts_with(kTcp) ? std::optional(port.substr(kTcp.size())) : std::nullopt;
}

std::string SerialStartOptions::describeLine() const {
  if (tcpAddress()) return "a terminal server";
  return fmt::format("{} baud, {}{}{}, {} flow control", settings.baud, settings.bitsPerChar, settings.parity, settings.stopBits,
                     settings.flowControl == 'H' ? "hardware" : "no");
}

std::optional<int> SerialStartOptions::parse(int argc, char** argv) {
  CLI::App app("mpf-serial-server - serves one serial line to the clients of a backplane", "mpf-serial-server");
  std::string eom = "\\r";
  arguments.messages.queueSize = 20;
  app.add_option("server", server, "Name under which clients find it")->required();
  app.add_option("port", port, "Terminal device, or tcp:HOST:PORT of a terminal server")->required();
  app.add_option("bufsize", serial.bufferBytes, "Longest answer [bytes]")->capture_default_str()->check(CLI::Range(1, 1 << 20));
  app.add_option("queuesize", arguments.messages.queueSize, "Requests of one client that may wait")->capture_default_str();
  app.add_option("eomstr", eom, "End of message of the instrument: 0 to 2 bytes, with escapes as in C")->capture_default_str();
  app.add_option("circular", serial.circularBuffer, "1: keep what is received while nobody reads; 0: drop it")->capture_default_str();
  app.add_option("--baud", settings.baud, "Speed [bit/s]")->capture_default_str();
  app.add_option("--parity", settings.parity, "E, O or N")->capture_default_str();
  app.add_option("--stop-bits", settings.stopBits, "1 or 2")->capture_default_str();
  app.add_option("--bits", settings.bitsPerChar, "Bits per character, 5 to 8")->capture_default_str();
  app.add_option("--flow", settings.flowControl, "H (hardware) or N")->capture_default_str();
  app.add_flag("--wait", wait, "Start even if the line is not there, and wait for it");
  arguments.addTo(app);
  app.footer(
      "The old command: initSerialServer(\"server\",\"port\",bufsize,queuesize,\"eomstr\",circular)\n"
      "Example: mpf-serial-server dmm /dev/ttyS0 1000 20 '\\r\\n' 1 --baud 19200");
  try {
    app.parse(argc, argv);
    const auto bytes = tryUnescape(eom);
    if (!bytes || bytes->size() > 2) throw CLI::ValidationError("eomstr", eom + ": use 0 to 2 bytes, with escapes as in C");
    serial.eom = *bytes;
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  }
  return std::nullopt;
}

}  // namespace mpf
