// SPDX-License-Identifier: MIT
// ServedPort: a serial port with its server and its listeners' server, run by a thread.
//
// Threads  its own after start(); stop() and countAlarm() from any.
#pragma once

#include <functional>
#include <string>

#include <mpf/drivers/serial/serial_port.h>

#include "server/programs/serial_server/serial_server.h"
#include "server/programs/serial_server/sniff_server.h"
#include "server/programs/serial_server/start_options.h"
#include "server/programs/server_log.h"
#include "server/programs/serving_thread.h"

namespace mpf {

class ServedPort {
 public:
  // Opens both servers and says so.
  //   port    outlives this
  //   throws  as MessageServer
  ServedPort(const Backplane& backplane, const SerialStartOptions& options,
             const SerialServerStart& start, SerialPort& port);
  ~ServedPort();
  ServedPort(const ServedPort&) = delete;
  ServedPort& operator=(const ServedPort&) = delete;

  // Serves, until stop(). `failed` is called, on any thread, when one of both servers ended for
  // another reason, which the log says.
  void start(std::function<void()> failed);
  void stop() { serial_.stop(); }
  // Waits for its end.
  void join() { thread_.join(); }
  void countAlarm() noexcept { server_.countAlarm(); }
  [[nodiscard]] const std::string& portName() const noexcept { return portName_; }

 private:
  const std::string portName_;
  SerialPort& port_;
  const ServerLog log_;
  MessageServer server_;
  SerialServer serial_;
  SniffServer sniff_;
  ServingThread thread_;
};

}  // namespace mpf
