// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/start_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <string_view>

#include "base/command_line.h"
#include "schema/text.h"
#include "server/programs/hardware/option_fields.h"
#include "shm/link.h"

namespace mpf {
namespace {

constexpr const char* kServerForm = "SERVER,PORT[,BUFSIZE[,QUEUESIZE[,EOMSTR[,CIRCULAR]]]]";

constexpr const char* kFooter =
    "Startup commands of the original MPF:\n"
    "  initSerialServer(\"server\", \"port\", bufsize, queuesize, \"eomstr\", circular)\n"
    "  initOctalUART(\"module\", \"carrier\", \"site\", nports, intVec)\n"
    "  initOctalUARTPort(\"port\", \"module\", n, baud, \"parity\", stopbits, bits, \"flow\")\n"
    "Examples:\n"
    "  mpf-serial-server dmm /dev/ttyS0 1000 20 '\\r\\n' 1 --baud 19200\n"
    "  mpf-serial-server --carrier ipac=model --octal-uart UART0,ipac,IP_a,8,100\n"
    "    --octal-port 'UART0[0],UART0,0,9600,N,1,8,N' --server "
    "'a-Serial[0],UART0[0],1000,20,\\r,1'\n"
    "    --octal-port 'UART0[1],UART0,1,38400,E,1,7,N' --server "
    "'a-Serial[1],UART0[1],1000,20,\\r\\n,1'";

constexpr int kLongestAnswer = 1 << 20;
constexpr int kLongestQueue = LinkGeometry::kMaxQueueSize;

// "none" serves where an empty text is the default.
std::optional<std::string> tryReadEom(const std::string& text) {
  if (text == "none") return "";
  auto bytes = tryUnescape(text);
  if (bytes && bytes->size() > 2) bytes.reset();
  return bytes;
}

// Checks the fields as the positional arguments are checked.
SerialServerStart readServer(OptionFields& fields) {
  SerialServerStart start;
  start.server = fields.word("server");
  start.port = fields.word("port");
  const int bufferBytes =
      fields.number("longest answer", static_cast<int>(start.serial.bufferBytes));
  if (bufferBytes < 1 || bufferBytes > kLongestAnswer)
    fields.complain(
        fmt::format("longest answer {}: use 1 to {} bytes", bufferBytes, kLongestAnswer));
  start.serial.bufferBytes = static_cast<std::size_t>(bufferBytes);
  start.queueSize = fields.queueSize();
  const auto eom = fields.word("end of message", "\\r");
  const auto bytes = tryReadEom(eom);
  if (!bytes)
    fields.complain(
        fmt::format("end of message {}: use 1 or 2 bytes, with escapes as in C, or none", eom));
  start.serial.eom = *bytes;
  start.serial.circularBuffer = fields.number("circular", 1) != 0;
  return start;
}

}  // namespace

std::optional<std::string> tcpAddressOf(const std::string& port) {
  constexpr std::string_view kTcp = "tcp:";
  return port.starts_with(kTcp) ? std::optional(port.substr(kTcp.size())) : std::nullopt;
}

std::string SerialStartOptions::describeLine(const std::string& port) const {
  if (tcpAddressOf(port)) return "a terminal server";
  const auto* const octalPort = octal.find(port);
  const auto& line = octalPort != nullptr ? octalPort->settings : settings;
  return fmt::format("{} baud, {}{}{}, {} flow control", line.baud, line.bitsPerChar, line.parity,
                     line.stopBits, line.flowControl == 'H' ? "hardware" : "no");
}

// Returns a contradiction between options; empty when there is no problem.
std::string SerialStartOptions::problem() const {
  if (servers.empty()) return "server is required";
  for (std::size_t i = 0; i < servers.size(); ++i) {
    const auto& start = servers[i];
    if (start.port.empty()) return "port is required";
    const auto sames =
        std::count_if(servers.begin(), servers.end(),
                      [&](const SerialServerStart& other) { return other.port == start.port; });
    if (sames > 1)
      return fmt::format("port {}: has two servers; a line can have only one", start.port);
  }
  for (const auto& port : octal.ports) {
    if (octal.findUart(port.module) == nullptr)
      return fmt::format("--octal-port: {}: no --octal-uart has the name {}", port.name,
                         port.module);
    if (octal.find(port.name) != &port)
      return fmt::format("--octal-port: {}: two ports have that name", port.name);
  }
  return {};
}

bool SerialStartOptions::hasTerminal() const {
  return std::ranges::any_of(servers, [&](const SerialServerStart& start) {
    return !tcpAddressOf(start.port) && octal.find(start.port) == nullptr;
  });
}

std::optional<int> SerialStartOptions::parse(int argc, char** argv) {
  CLI::App app("mpf-serial-server - serves serial lines to the clients of a backplane",
               "mpf-serial-server");
  SerialServerStart first;
  std::vector<SerialServerStart> others;
  std::string eom = "\\r";
  app.add_option("server", first.server, "Name under which clients find it");
  app.add_option("port", first.port,
                 "Terminal device, tcp:HOST:PORT of a terminal server, or PORT of --octal-port");
  app.add_option("bufsize", first.serial.bufferBytes, "Longest answer [bytes]")
      ->capture_default_str()
      ->check(wholeNumber(1, kLongestAnswer));
  app.add_option("queuesize", first.queueSize, "Requests of one client that may wait")
      ->capture_default_str()
      ->check(wholeNumber(1, kLongestQueue));
  app.add_option("eomstr", eom,
                 "End of message of the instrument: 1 or 2 bytes, with escapes as in C, or none")
      ->capture_default_str();
  app.add_option("circular", first.serial.circularBuffer,
                 "1: keep bytes that are received while no request reads; 0: drop them")
      ->capture_default_str();
  addFields(
      app, "--server", kServerForm,
      "Adds a server, with the fields of the arguments above; an empty field has its default; may "
      "be repeated",
      [&others](OptionFields& fields) { others.push_back(readServer(fields)); });
  const std::array ofTerminals{
      app.add_option("--baud", settings.baud, "Speed of terminal devices [bit/s]")
          ->capture_default_str(),
      app.add_option("--parity", settings.parity, "Parity of terminal devices: E, O or N")
          ->capture_default_str(),
      app.add_option("--stop-bits", settings.stopBits, "Stop bits of terminal devices: 1 or 2")
          ->capture_default_str(),
      app.add_option("--bits", settings.bitsPerChar,
                     "Bits per character of terminal devices, 5 to 8")
          ->capture_default_str(),
      app.add_option("--flow", settings.flowControl,
                     "Flow control of terminal devices: H (hardware) or N")
          ->capture_default_str()};
  octal.addTo(app);
  limits.addTo(app);
  hardware.addTo(app);
  app.get_option("--wait")->description(
      "Start even if the line or its board is missing, and wait for it");
  arguments.addTo(app);
  app.footer(kFooter);
  if (const auto status = parseCommandLine(app, argc, argv)) return status;
  const auto bytes = tryReadEom(eom);
  if (!bytes)
    return refuseArguments(app.get_name(),
                           "eomstr: " + eom + ": use 1 or 2 bytes, with escapes as in C, or none");
  first.serial.eom = *bytes;
  if (!first.server.empty()) servers.push_back(first);
  servers.insert(servers.end(), others.begin(), others.end());
  for (auto& start : servers) start.serial.limits = limits;
  if (const auto why = problem(); !why.empty()) return refuseArguments(app.get_name(), why);
  const auto useless = std::ranges::find_if(
      ofTerminals, [](const CLI::Option* option) { return option->count() > 0; });
  if (useless != ofTerminals.end() && !hasTerminal()) {
    return refuseArguments(
        app.get_name(),
        fmt::format(
            "{} is for terminal devices, and no port is one: --octal-port has settings for its "
            "port, and a terminal server keeps its own settings",
            (*useless)->get_name()));
  }
  return std::nullopt;
}

}  // namespace mpf
