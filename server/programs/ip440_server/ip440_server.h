// SPDX-License-Identifier: MIT
// Ip440Server: reads the inputs of an IP440 for clients, as described in
// include/mpf/digital_io_commands.h.
//
//   client                                   server
//     Int32 cmdReadBits   address=mask ──►
//           cmdReadBits16 address=mask extra=lowest bit ──►
//                                        ◄── the same with status 0 and value=bits,
//                                            or status -1: unknown cmd, or the module fails
//
// Threads  the thread of the server.
#pragma once

#include <mpf/message_server.h>

#include "drivers/ip440/ip440.h"
#include "server/programs/hardware/fault_note.h"
#include "server/programs/server_log.h"

namespace mpf {

class Ip440Server {
 public:
  // Handles every request of `server`. The arguments must outlive this object.
  Ip440Server(MessageServer& server, Ip440& inputs, const ServerLog& log);

 private:
  void handle(Int32& shared);
  [[nodiscard]] bool tryAnswer(Int32& request);

  Ip440& inputs_;
  const ServerLog& log_;
  FaultNote faults_;
};

}  // namespace mpf
