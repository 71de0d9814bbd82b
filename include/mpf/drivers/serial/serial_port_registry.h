// SPDX-License-Identifier: MIT
// SerialPortRegistry: ports by name. main() owns it; the ports live as long as somebody holds them.
//
//   registry.registerName("UART[0]", std::make_shared<PosixTerminalPort>(options));
//   auto line = registry.bind("UART[0]", handler);
//   auto tap = registry.find("UART[0]")->attachTap(print);
//
// Threads  any.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <mpf/drivers/serial/serial_port.h>

namespace mpf {

class SerialPortRegistry {
 public:
  // Throws std::invalid_argument when the name is empty or another port's.
  void registerName(const std::string& portName, std::shared_ptr<SerialPort> port);
  // Null when there is none.
  [[nodiscard]] std::shared_ptr<SerialPort> find(const std::string& portName) const;
  // Throws std::invalid_argument when there is no such port, std::runtime_error when somebody else
  // is bound to it.
  [[nodiscard]] BoundSerialPort bind(const std::string& portName, ByteHandler& handler) const;
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<SerialPort>> ports_;
};

}  // namespace mpf
