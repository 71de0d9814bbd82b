// SPDX-License-Identifier: MIT
#include "crate/startup/commands/serial_lines.h"

#include <algorithm>
#include <fmt/format.h>

#include "crate/startup/commands/process_builder.h"

namespace mpf::startup {
namespace {

// Bytes as the serial server takes them: with the escapes of C, and without commas. An empty field
// would be the default.
std::string escaped(const std::string& bytes) {
  if (bytes.empty()) return "none";
  std::string text;
  for (const char byte : bytes) {
    if (byte == '\r') text += "\\r";
    else if (byte == '\n') text += "\\n";
    else if (byte <= ' ' || byte >= 0x7f || byte == '\\' || byte == ',')
      text += fmt::format("\\x{:02x}", static_cast<unsigned char>(byte));
    else text += byte;
  }
  return text;
}

// The number as a field; empty: the default.
std::string fieldOf(std::int64_t number) { return number == 0 ? "" : fmt::to_string(number); }

}  // namespace

bool SerialLines::addModule(SerialModule module) {
  if (findModule(module.name) != nullptr) return false;
  modules_.push_back(std::move(module));
  return true;
}

bool SerialLines::addPort(SerialPort port) {
  if (findPort(port.name) != nullptr) return false;
  ports_.push_back(std::move(port));
  return true;
}

bool SerialLines::addAlias(const std::string& name, const std::string& port) {
  return findPort(name) == nullptr && aliases_.emplace(name, port).second;
}

const SerialModule* SerialLines::findModule(const std::string& name) const {
  const auto found = std::ranges::find(modules_, name, &SerialModule::name);
  return found != modules_.end() ? &*found : nullptr;
}

void SerialLines::addServer(SerialServer server) {
  server.port = portNamed(server.port);
  servers_.push_back(std::move(server));
}

const std::string& SerialLines::portNamed(const std::string& portOrAlias) const {
  const auto found = aliases_.find(portOrAlias);
  return found != aliases_.end() ? found->second : portOrAlias;
}

SerialPort* SerialLines::findPort(const std::string& portOrAlias) {
  const auto found = std::ranges::find(ports_, portNamed(portOrAlias), &SerialPort::name);
  return found != ports_.end() ? &*found : nullptr;
}

const SerialServer* SerialLines::serverOf(const std::string& portOrAlias) const {
  const auto found = std::ranges::find(servers_, portNamed(portOrAlias), &SerialServer::port);
  return found != servers_.end() ? &*found : nullptr;
}

const SerialPort* SerialLines::portOf(const std::string& module, std::int64_t index) const {
  const auto found = std::ranges::find_if(
      ports_, [&](const SerialPort& port) { return port.module == module && port.index == index; });
  return found != ports_.end() ? &*found : nullptr;
}

std::vector<std::string> SerialLines::portNames() const {
  std::vector<std::string> names;
  for (const auto& port : ports_) names.push_back(port.name);
  for (const auto& [name, port] : aliases_) names.push_back(name);
  return names;
}

std::vector<crate::Process> SerialLines::processes() const {
  std::vector<crate::Process> processes;
  for (const auto& module : modules_) {
    auto process = processOf(module);
    if (process.find("server") != nullptr) processes.push_back(std::move(process));
  }
  for (const auto& port : ports_)
    if (port.module.empty() && serverOf(port.name) != nullptr) processes.push_back(processOf(port));
  return processes;
}

crate::Process SerialLines::processOf(const SerialModule& module) const {
  auto process = newProcess("serial", module.name, module.place, module.source);
  addValue(process, "octal-uart",
           fmt::format("{},{},{},{},{}", module.name, module.carrier, module.site, module.ports,
                       module.vector),
           module.place);
  for (const auto& port : ports_) {
    if (port.module != module.name) continue;
    const auto& line = port.settings;
    addValue(process, "octal-port",
             fmt::format("{},{},{},{},{},{},{},{}", port.name, module.name, port.index, line.baud,
                         line.parity, line.stopBits, line.bits, line.flow),
             port.place);
    addServer(port.name, port.name, process);
  }
  return process;
}

crate::Process SerialLines::processOf(const SerialPort& port) const {
  auto process = newProcess("serial", port.name, port.place, port.source);
  addServer(port.name, port.device, process);
  addValue(process, "wait", "true", port.place);  // as the original, which started without the line
  if (port.device.starts_with("tcp:")) return process;
  const auto& line = port.settings;
  addValue(process, "baud", fmt::to_string(line.baud), port.place);
  addValue(process, "parity", std::string(1, line.parity), port.place);
  addValue(process, "stop-bits", fmt::to_string(line.stopBits), port.place);
  addValue(process, "bits", fmt::to_string(line.bits), port.place);
  addValue(process, "flow", std::string(1, line.flow), port.place);
  return process;
}

void SerialLines::addServer(const std::string& port, const std::string& device,
                            crate::Process& process) const {
  const auto* const server = serverOf(port);
  if (server == nullptr) return;
  addValue(process, "server",
           fmt::format("{},{},{},{},{},{}", server->name, device, fieldOf(server->bufferSize),
                       fieldOf(server->queueSize), escaped(server->endOfMessage),
                       server->isCircular ? 1 : 0),
           server->place);
}

}  // namespace mpf::startup
