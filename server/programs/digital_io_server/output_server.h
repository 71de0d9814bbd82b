// SPDX-License-Identifier: MIT
// DigitalOutputServer: requests of clients become bits on the outputs of a digital module, as
// include/mpf/digital_io_commands.h has it.
//
// Threads  one: the server's.
#pragma once

#include <mpf/digital_io_commands.h>
#include <mpf/message_server.h>

#include "drivers/digital_io/digital_io.h"
#include "server/programs/hardware/fault_note.h"
#include "server/programs/server_log.h"

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
