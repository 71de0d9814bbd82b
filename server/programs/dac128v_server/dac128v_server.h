// SPDX-License-Identifier: MIT
// Dac128vServer: requests of clients become codes on the outputs of a DAC128V (manual, "Systran
// DAC128V Support").
//
//   client                                 server
//     Int32 address=channel value=code ──►
//                                      ◄── the same with status 0, or -1: nothing was written, or it is not on the output
//
// A module that has lost what was written to it, by a reset or a power cycle, gets it again with
// the next request: an alarm in `mpf msr`.
//
// Threads  one: the server's.
#pragma once

#include <mpf/drivers/dac128v.h>
#include <mpf/message_server.h>

#include "server/programs/hardware/fault_note.h"
#include "server/programs/server_log.h"

namespace mpf {

class Dac128vServer {
 public:
  // Answers every request of `server`. All that is passed must outlive this.
  Dac128vServer(MessageServer& server, Dac128v& dac, const ServerLog& log);

 private:
  void handle(Int32& request);

  Dac128v& dac_;
  const ServerLog& log_;
  FaultNote faults_;
  bool isAsked_ = false;  // there was a request
  std::uint64_t restorations_ = 0;  // of the module's outputs, as told
};

}  // namespace mpf
