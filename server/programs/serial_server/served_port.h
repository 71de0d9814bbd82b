// SPDX-License-Identifier: MIT
// ServedPort: a serial port with its two servers, for requests and for listeners, each on a thread.
//
// Threads  one thread constructs, starts and joins it; any thread may call stop() and countAlarm().
#pragma once

#include <functional>
#include <string>

#include <mpf/drivers/serial/serial_port.h>

#include "server/programs/serial_server/serial_server.h"
#include "server/programs/serial_server/start_options.h"
#include "server/programs/server_log.h"
#include "server/programs/serving_thread.h"
#include "server/programs/sniff/sniff_server.h"

namespace mpf {

class ServedPort {
 public:
  // Opens both servers and logs their names.
  //   port    outlives this
  //   throws  as MessageServer
  ServedPort(const Backplane& backplane, const SerialStartOptions& options,
             const SerialServerStart& start, SerialPort& port);
  ~ServedPort();
  ServedPort(const ServedPort&) = delete;
  ServedPort& operator=(const ServedPort&) = delete;

  // Serves until stop(). `failed` is called, on any thread, when one of the two servers has failed,
  // after it has logged the error.
  void start(std::function<void()> failed);
  void stop() { serial_.stop(); }
  // Waits until the thread of the server has ended.
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
