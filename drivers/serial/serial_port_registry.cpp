// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/serial_port_registry.h>

#include <fmt/format.h>
#include <stdexcept>
#include <utility>

namespace mpf {

void SerialPortRegistry::registerName(const std::string& portName,
                                      std::shared_ptr<SerialPort> port) {
  if (portName.empty()) throw std::invalid_argument("register a serial port: the name is empty");
  const std::lock_guard lock(mutex_);
  if (!ports_.emplace(portName, std::move(port)).second) {
    throw std::invalid_argument(
        fmt::format("register serial port \"{}\": the name is in use", portName));
  }
}

std::shared_ptr<SerialPort> SerialPortRegistry::find(const std::string& portName) const {
  const std::lock_guard lock(mutex_);
  const auto found = ports_.find(portName);
  return found == ports_.end() ? nullptr : found->second;
}

BoundSerialPort SerialPortRegistry::bind(const std::string& portName, ByteHandler& handler) const {
  auto port = find(portName);
  if (!port)
    throw std::invalid_argument(fmt::format("bind serial port \"{}\": unknown name", portName));
  return {std::move(port), handler};
}

std::vector<std::string> SerialPortRegistry::names() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  names.reserve(ports_.size());
  for (const auto& [name, port] : ports_) names.push_back(name);
  return names;
}

}  // namespace mpf
