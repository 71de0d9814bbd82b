// SPDX-License-Identifier: MIT
// SerialServer: requests of clients become requests to a serial port (manual, "serialServer").
//
// Threads  one: the server's. A request occupies the line until its answer, its time or its retries are over.
#pragma once

#include <string>

#include <mpf/drivers/serial/serial_port.h>
#include <mpf/server/message_server.h>
#include <mpf/server/programs/serial_server/line_reader.h>

namespace mpf {

struct SerialServerOptions {
  std::size_t bufferBytes = 1000;
  std::string eom = "\r";  // 0 to 2 bytes
  bool circularBuffer = true;
};

class SerialServer {
 public:
  // Answers Char8Array and SerialConfig requests of `server`; other types are refused by it.
  SerialServer(MessageServer& server, SerialPort& port, const SerialServerOptions& options);

 private:
  void handle(Char8ArrayMessage&& request);
  void configure(SerialConfigMessage&& request);
  void applyOptions(const Char8Array& request);
  // One attempt. Returns a serialServerStatus; `answer` is what was read.
  std::int32_t attempt(const Char8Array& request, SerialPort::Bytes data, std::string& answer);

  MessageServer& server_;
  LineReader reader_;
  BoundSerialPort port_;
};

}  // namespace mpf
