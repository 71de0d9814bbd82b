// SPDX-License-Identifier: MIT
// SerialPortRegistry: the serial ports of a program, by name. main() owns it. It shares the
// ownership of each port with the callers of find() and bind().
//
//   registry.registerName("UART[0]", openPosixTerminal(options));
//   auto line = registry.bind("UART[0]", handler);
//   auto tap = registry.find("UART[0]")->attachTap(print);
//
// Threads  any number of callers at a time.
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
  //   throws  std::invalid_argument when the name is empty or in use
  void registerName(const std::string& portName, std::shared_ptr<SerialPort> port);
  // Returns nullptr when no port has this name.
  [[nodiscard]] std::shared_ptr<SerialPort> find(const std::string& portName) const;
  // Binds `handler` to the port; see SerialPort::bind().
  //   throws  std::invalid_argument when no port has this name, std::runtime_error when the port is
  //           bound already
  [[nodiscard]] BoundSerialPort bind(const std::string& portName, ByteHandler& handler) const;
  // All names, sorted.
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<SerialPort>> ports_;
};

}  // namespace mpf
