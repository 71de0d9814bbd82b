// SPDX-License-Identifier: MIT
// Dac128vServer: writes the outputs of a DAC128V for clients (manual, "Systran DAC128V Support").
//
//   client                                 server
//     Int32 address=channel value=code ──►
//                                      ◄── the same with status 0, or -1: the output was not set
//
// When a reset or a power cycle has cleared the outputs, the next request restores them and counts
// an alarm (`mpf msr`).
//
// Threads  the thread of the server.
#pragma once

#include <mpf/drivers/dac128v.h>
#include <mpf/message_server.h>

#include "server/programs/hardware/fault_note.h"
#include "server/programs/server_log.h"

namespace mpf {

class Dac128vServer {
 public:
  // Handles every request of `server`. The arguments must outlive this object.
  Dac128vServer(MessageServer& server, Dac128v& dac, const ServerLog& log);

 private:
  void handle(Int32& request);

  Dac128v& dac_;
  const ServerLog& log_;
  FaultNote faults_;
  bool isAsked_ = false;  // there was a request
  std::uint64_t restorations_ = 0;  // of the module's outputs that were reported
};

}  // namespace mpf
