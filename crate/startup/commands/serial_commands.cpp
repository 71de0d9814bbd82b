// SPDX-License-Identifier: MIT
// Commands of serial ports and servers.
#include <algorithm>
#include <fmt/format.h>

#include "base/toml/toml_table.h"
#include "crate/startup/commands/command_table.h"
#include "crate/startup/commands/process_builder.h"
#include "crate/startup/shell/lexer.h"
#include "drivers/octal_uart/octal_uart_settings.h"

namespace mpf::startup {
namespace {

constexpr std::int64_t kMaxSerialBuffer = 1 << 20;

// Adds the port also after an error, which later commands need not repeat.
Value addPort(CommandCall& call, StartupSite& site, SerialPort port) {
  port.place = call.place();
  port.source = call.source();
  const auto name = port.name;
  if (!name.empty() && !site.serialLines.addPort(std::move(port)))
    call.refuse(0, fmt::format("the port \"{}\" exists already", name));
  return call.isValid() ? Value() : Value::unavailable();
}

Value initOctalUart(CommandCall& call, StartupSite& site) {
  SerialModule module;
  module.name = call.name(0, "module");
  const auto where = readSite(call, 1, site.boards);
  module.carrier = where.carrier;
  module.site = where.site;
  module.ports = call.has(3) ? call.integer(3, "nports", 4, 8) : 8;
  if (module.ports != 4 && module.ports != 8)
    call.refuse(3, fmt::format("nports is {}; a module has 4 or 8", module.ports));
  module.vector = call.integer(4, "interrupt vector", 0, 255);
  module.place = call.place();
  module.source = call.source();
  const auto name = module.name;
  if (!name.empty() && !site.serialLines.addModule(std::move(module)))  // also after an error
    call.refuse(0, fmt::format("the module \"{}\" exists already", name));
  return call.isValid() ? Value::ofOpaque(ModuleHandle{name}) : Value::unavailable();
}

Value initOctalUartPort(CommandCall& call, StartupSite& site) {
  SerialPort port;
  port.name = call.name(0, "port");
  port.module = call.name(1, "module");
  const auto* const module = site.serialLines.findModule(port.module);
  if (module == nullptr && !port.module.empty())
    call.refuse(1, fmt::format("there is no module \"{}\"; initOctalUART(\"{}\", ...) must come "
                               "before this line",
                               port.module, port.module));
  port.index = call.integer(2, "number of the port", 0, module == nullptr ? 7 : module->ports - 1);
  port.settings = readOctalSettings(call, 3);
  checkPortIsFree(call, 2, site, port.module, port.index);
  return addPort(call, site, std::move(port));
}

// initTtyPort("port", "/dev/ttyS0", baud, "N", stop, bits, "N", bufSize)
Value initTtyPort(CommandCall& call, StartupSite& site) {
  SerialPort port;
  port.name = call.name(0, "port");
  port.device = call.name(1, "device");
  port.settings = readLineSettings(call, 2);
  return addPort(call, site, std::move(port));
}

// initInetPort("port", "host", tcpPort, bufSize)
Value initInetPort(CommandCall& call, StartupSite& site) {
  SerialPort port;
  port.name = call.name(0, "port");
  const auto host = call.name(1, "host");
  port.device = fmt::format("tcp:{}:{}", host, call.integer(2, "TCP port", 1, 65535));
  return addPort(call, site, std::move(port));
}

// initSerialServer("server", "port", bufSize, queueSize, "eom"[, circular]). R2 has no last
// argument, and always keeps what is received while no request reads.
Value initSerialServer(CommandCall& call, StartupSite& site) {
  SerialServer server;
  server.name = call.name(0, "server");
  server.port = call.name(1, "port");
  server.bufferSize = call.integer(2, "bufSize", 0, kMaxSerialBuffer);
  server.queueSize = call.queueSize(3);
  server.endOfMessage = readEndOfMessage(call, 4);
  server.isCircular = !call.has(5) || call.integer(5, "circular mode", 0, 1) != 0;
  server.place = call.place();
  server.source = call.source();
  if (const auto* const other = site.serialLines.serverOf(server.port))
    call.refuse(
        1, fmt::format(R"(the port "{}" has the server "{}" already)", server.port, other->name));
  if (!server.port.empty() && site.serialLines.findPort(server.port) == nullptr) {
    const auto ports = site.serialLines.portNames();
    call.refuse(1, ports.empty()
                       ? fmt::format("there is no port \"{}\"; initOctalUARTPort or initTtyPort "
                                     "must come before this line",
                                     server.port)
                       : fmt::format("there is no port \"{}\" at this line; {}", server.port,
                                     suggestion(server.port, ports, "ports")));
  }
  if (!call.isValid()) return Value::unavailable();
  site.serialLines.addServer(std::move(server));
  return Value();
}

// serialPortSniff("port", seconds): prints the bytes of a port for a time.
Value serialPortSniff(CommandCall& call, StartupSite& site) {
  const auto port = call.name(0, "port");
  const auto seconds = call.integer(1, "seconds", 0, 1'000'000'000);
  const auto* const server = site.serialLines.serverOf(port);
  if (call.isValid() && server == nullptr)
    call.refuse(0, fmt::format("the port \"{}\" has no serial server at this line", port));
  if (!call.isValid()) return Value::unavailable();
  auto sniffer = newProcess("", "sniff-" + port, call.place(), call.source());
  sniffer.command = {"mpf", "sniff", server->name, fmt::to_string(seconds)};
  sniffer.needs = {server->name};
  sniffer.supervision.restart = crate::Restart::never;
  site.sniffers.push_back(std::move(sniffer));
  return Value();
}

constexpr CommandEntry kSerialCommands[] = {
    {"initOctalUART", initOctalUart},       {"initOctalUARTPort", initOctalUartPort},
    {"initTtyPort", initTtyPort},           {"initInetPort", initInetPort},
    {"initSerialServer", initSerialServer}, {"serialPortSniff", serialPortSniff},
    {"serialPortPeek", serialPortSniff},
};

}  // namespace

std::span<const CommandEntry> serialCommands() { return kSerialCommands; }

LineSettings readLineSettings(CommandCall& call, std::size_t index) {
  LineSettings line;
  line.baud = call.integer(index, "baud", 1, 4'000'000);
  line.parity = call.letter(index + 1, "parity", "NEO", 'N');
  line.stopBits = call.has(index + 2) ? call.integer(index + 2, "stopBits", 1, 2) : 1;
  line.bits = call.has(index + 3) ? call.integer(index + 3, "bits", 5, 8) : 8;
  line.flow = call.letter(index + 4, "flow control", "NH", 'N');
  return line;
}

LineSettings readOctalSettings(CommandCall& call, std::size_t index) {
  const auto line = readLineSettings(call, index);
  checkOctalBaud(call, index, line.baud);
  return line;
}

void checkOctalBaud(CommandCall& call, std::size_t index, std::int64_t baud) {
  if (const auto problem = octalUartProblemOf({.baud = static_cast<int>(baud)}, false);
      !problem.empty())
    call.refuse(index, problem);
}

void checkPortIsFree(CommandCall& call, std::size_t index, const StartupSite& site,
                     const std::string& module, std::int64_t number) {
  if (const auto* const other = site.serialLines.portOf(module, number))
    call.refuse(index, fmt::format(R"(port {} of the module "{}" is the port "{}" already)", number,
                                   module, other->name));
}

std::string readEndOfMessage(CommandCall& call, std::size_t index) {
  auto bytes = unescaped(call.textOr(index, "eom", ""));
  if (bytes.size() > 2)
    call.refuse(index, fmt::format("eom has {} bytes; at most 2 are possible", bytes.size()));
  return bytes;
}

}  // namespace mpf::startup
