// SPDX-License-Identifier: MIT
// DigitalOutputServer: requests of clients become bits on the outputs of a digital module, as schema/digital_io_server.h has it.
//
// Threads  one: the server's.
#pragma once

#include <mpf/drivers/digital_io/digital_io.h>
#include <mpf/schema/digital_io_server.h>
#include <mpf/server/message_server.h>
#include <mpf/server/programs/hardware/fault_note.h>
#include <mpf/server/programs/server_log.h>

namespace mpf {

class DigitalOutputServer {
 public:
  // Answers every request of `server`. All that is passed must outlive this.
  DigitalOutputServer(MessageServer& server, DigitalIo& io, const ServerLog& log);

 private:
  void handle(Int32& shared);
  [[nodiscard]] DigitalIoStatus perform(const Int32& request) noexcept;
  void note(DigitalIoStatus status, const Int32& request);

  DigitalIo& io_;
  const ServerLog& log_;
  FaultNote faults_;
  bool isAsked_ = false;  // there was a request
};

}  // namespace mpf
