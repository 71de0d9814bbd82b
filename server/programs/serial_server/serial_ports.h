// SPDX-License-Identifier: MIT
// SerialPorts: opens the ports of a command line, and owns them and the modules of octal UARTs.
//
// With --wait every port exists from the start, and is unplugged until its line is found: a missing
// module does not delay other lines.
//
// Threads  the main thread of the program; the thread of a port opens its module if that was
//          missing at the start.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include <mpf/drivers/serial/serial_port_registry.h>

#include "drivers/octal_uart/octal_uart.h"
#include "server/programs/serial_server/start_options.h"
#include "server/programs/server_log.h"

namespace mpf {

class SerialPorts {
 public:
  // Receives the name of a module whose interrupts arrive without end or not at all. A lost line is
  // reported by its port instead.
  using AlarmHandler = std::function<void(const std::string& module)>;

  // Opens all ports.
  //   options, log  outlive this
  //   throws        what the ports' constructors throw
  SerialPorts(SerialStartOptions& options, const ServerLog& log);

  [[nodiscard]] SerialPort& find(const std::string& port) const { return *registry_.find(port); }
  // Sets the handler of alarms, which are logged as well. After return the former handler does not
  // run any more.
  void onAlarm(AlarmHandler handler);

 private:
  [[nodiscard]] bool tryOpenModule(const OctalUartStart& start);
  [[nodiscard]] bool hasModule(const std::string& name);
  IndustryPackModule& openModule(const OctalUartStart& start);
  OctalUart& openUart(const OctalUartStart& start);
  void follow(OctalUart& uart, const std::string& module) const;
  [[nodiscard]] std::shared_ptr<SerialPort> openPort(const std::string& port);
  [[nodiscard]] std::shared_ptr<SerialPort> openLine(const std::string& port);
  [[nodiscard]] std::shared_ptr<SerialPort> openOctalPort(const OctalPortStart& start);
  [[nodiscard]] std::shared_ptr<SerialPort> openLater(const OctalPortStart& port,
                                                      const OctalUartStart& uart);

  SerialStartOptions& options_;
  const ServerLog& log_;
  std::mutex mutex_;  // all below but the last, and the modules in options_
  AlarmHandler alarmHandler_;
  std::map<std::string, std::unique_ptr<OctalUart>> uarts_;
  SerialPortRegistry registry_;  // last: its ports use what is above
};

}  // namespace mpf
