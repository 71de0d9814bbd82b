// SPDX-License-Identifier: MIT
// SerialServer: requests of clients become requests to a serial port (manual, "serialServer").
//
// Threads  one: the server's; stop() from another. A request occupies the line until its answer, its time or its retries are over.
#pragma once

#include <atomic>
#include <string>

#include <mpf/drivers/serial/serial_port.h>
#include <mpf/server/message_server.h>
#include <mpf/server/programs/serial_server/line_faults.h>
#include <mpf/server/programs/serial_server/line_reader.h>
#include <mpf/server/programs/server_log.h>

namespace mpf {

struct SerialServerOptions {
  std::size_t bufferBytes = 1000;
  std::string eom = "\r";  // 0 to 2 bytes
  bool circularBuffer = true;
};

class SerialServer {
 public:
  // Answers Char8Array and SerialConfig requests of `server`, and those of other types with status -1.
  // All that is passed must outlive this, but for the options.
  SerialServer(MessageServer& server, SerialPort& port, const SerialServerOptions& options, const ServerLog& log);

  // Ends the server's run(). A request that is on the line is answered at once with serialServerStatusError and what was read; those that
  // the server has not taken end with it, as `neverTaken`.
  void stop();

 private:
  void handle(Char8ArrayMessage&& request);
  void configure(SerialConfigMessage&& request);
  void noteRequest();
  void noteStatus(const Char8Array& request, std::int32_t status);
  [[nodiscard]] std::string whyFailed(const Char8Array& request) const;
  void applyOptions(const Char8Array& request);
  // One attempt. Returns a serialServerStatus; `answer` is what was read.
  std::int32_t attempt(const Char8Array& request, SerialPort::Bytes data, std::string& answer);

  MessageServer& server_;
  const ServerLog& log_;
  LineFaults faults_;  // of the line
  LineReader reader_;
  BoundSerialPort port_;
  bool isAsked_ = false;  // there was a request
  bool isFailing_ = false;  // the last one was an error
  std::atomic<bool> isStopped_{false};
};

}  // namespace mpf
