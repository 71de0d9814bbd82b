// SPDX-License-Identifier: MIT
// SerialPorts: opens the ports that a command line speaks of, and owns them and the modules that
// some of them are on.
//
// With --wait every port is there from the start, and unplugged until its line is there: a module
// that is absent keeps no other line waiting.
//
// Threads  the program's main thread; a module that comes later is opened on the thread of one of
//          its ports.
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
  // Told of a module's interrupts that come without end, or not at all, and which one it is. Of a
  // line that is lost its port tells.
  using AlarmHandler = std::function<void(const std::string& module)>;

  // Opens all of them.
  //   options, log  outlive this
  //   throws        what the ports' constructors throw
  SerialPorts(SerialStartOptions& options, const ServerLog& log);

  [[nodiscard]] SerialPort& find(const std::string& port) const { return *registry_.find(port); }
  // What is wrong with modules is logged and told to `handler`, instead of the one before, which
  // after return does not run any more.
  void onAlarm(AlarmHandler handler);

 private:
  [[nodiscard]] bool tryOpenModule(const OctalUartStart& start);
  [[nodiscard]] bool hasModule(const std::string& name);
  IndustryPackModule& openModule(const OctalUartStart& start);
  OctalUart& openUart(const OctalUartStart& start);
  void follow(OctalUart& uart, const std::string& module) const;
  [[nodiscard]] std::shared_ptr<SerialPort> openPort(const std::string& port);
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
