// SPDX-License-Identifier: MIT
// SerialServer: performs requests of clients on a serial port (manual, "serialServer").
//
//   request ─► in step? ─► port ─► answer, timeout, failure ─► retry? ─► reply
//                 └ see LineSync
//
// A request uses the line until it has its answer, or its time or its retries are used up, both
// limited by LineLimits, or its client has disconnected.
//
// Threads  one: the server's. Another thread may call stop().
// Trust    a client may request any timeout and any number of retries, or die: other clients wait
//          at most LineLimits::maxTimeout for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <mpf/clock.h>
#include <mpf/drivers/serial/serial_port.h>
#include <mpf/message_server.h>

#include "server/programs/serial_server/line_faults.h"
#include "server/programs/serial_server/line_reader.h"
#include "server/programs/server_log.h"

namespace mpf {

struct SerialServerOptions {
  std::size_t bufferBytes = 1000;
  std::string eom = "\r";  // 0 to 2 bytes
  bool circularBuffer = true;
  LineLimits limits = {};
};

class SerialServer {
 public:
  // Sets the handlers of `server`: it performs Char8Array and SerialConfig requests and replies to
  // other types with status -1. Surplus input counts as an alarm of `server`.
  //   server, port, log   must outlive this object
  SerialServer(MessageServer& server, SerialPort& port, const SerialServerOptions& options,
               const ServerLog& log);

  // Ends the server's run(). The request in progress immediately gets a reply with
  // serialServerStatusError and the bytes that were read. Requests that the server has not received
  // end as `neverTaken` when the server is destroyed.
  void stop();

 private:
  // The request in progress.
  struct Work {
    Char8Array fields;
    std::vector<std::uint8_t> data;
    Deadline until = Deadline::never();  // of all attempts together
    int retries = 0;  // left
    bool continues = false;  // the next attempt continues a read that ended with a timeout
    std::function<bool()> isAbandoned = {};
    std::int32_t status = 0;  // a serialServerStatus
    std::string answer = {};  // what was read last
    std::string problem = {};  // why the status is serialServerStatusError, if that is known
  };

  void handle(Char8ArrayMessage&& request);
  void configure(SerialConfigMessage&& request);
  void perform(const Char8ArrayMessage& request, Work& work);
  void reply(const Char8ArrayMessage& request, const Work& work);
  void applyOptions(const Char8Array& request);
  [[nodiscard]] Work workOf(const Char8ArrayMessage& request);
  // True when the request ends without its answer: the server stops, the line is unplugged, or the
  // client is gone.
  [[nodiscard]] bool isAbandoned(const Char8ArrayMessage& request, bool isWrite);

  void serve(Work& work);
  void attempt(Work& work);
  void read(Work& work, bool flush);
  void write(Work& work);
  void ask(Work& work);
  void flush();
  void takeLateAnswer(Work& work);
  // Returns false when nothing was sent, because input arrived immediately before.
  bool takeAnswer(Work& work, SerialPortStatus status);
  [[nodiscard]] bool isInStep(Work& work, bool isQuestion, Deadline until);
  [[nodiscard]] Deadline deadlineOf(const Work& work) const;

  void noteRequest();
  void noteStatus(const Work& work);
  [[nodiscard]] std::string whyFailed(const Work& work) const;
  void noteSurplus();
  void noteLimits(const Char8Array& request);

  MessageServer& server_;
  const ServerLog& log_;
  const LineLimits limits_;
  LineFaults faults_;  // of the line
  bool isAsked_ = false;  // there was a request
  bool isFailing_ = false;  // the last one was an error
  Deadline writeEnds_ = Deadline::never();  // of a plain write whose client is gone
  std::atomic<bool> isStopped_{false};
  LineReader reader_;
  BoundSerialPort port_;  // last: it calls the reader
};

}  // namespace mpf
