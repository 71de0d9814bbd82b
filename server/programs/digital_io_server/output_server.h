// SPDX-License-Identifier: MIT
// DigitalOutputServer: writes the outputs of a digital module for clients, as described in
// include/mpf/digital_io_commands.h.
//
// Threads  the thread of the server.
#pragma once

#include <mpf/digital_io_commands.h>
#include <mpf/message_server.h>

#include "drivers/digital_io/digital_io.h"
#include "server/programs/hardware/fault_note.h"
#include "server/programs/server_log.h"

namespace mpf {

class DigitalOutputServer {
 public:
  // Handles every request of `server`. The arguments must outlive this object.
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
