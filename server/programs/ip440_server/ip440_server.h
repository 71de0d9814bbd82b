// SPDX-License-Identifier: MIT
// Ip440Server: clients read the inputs of an IP440, as include/mpf/digital_io_commands.h has it.
//
//   client                                   server
//     Int32 cmdReadBits   address=mask ──►
//           cmdReadBits16 address=mask extra=lowest bit ──►
//                                        ◄── the same with status 0 and value=bits; or -1: there is no such cmd, or the module is gone
//
// Threads  one: the server's.
#pragma once

#include <mpf/message_server.h>

#include "drivers/ip440/ip440.h"
#include "server/programs/hardware/fault_note.h"
#include "server/programs/server_log.h"

namespace mpf {

class Ip440Server {
 public:
  // Answers every request of `server`. All that is passed must outlive this.
  Ip440Server(MessageServer& server, Ip440& inputs, const ServerLog& log);

 private:
  void handle(Int32& shared);
  [[nodiscard]] bool tryAnswer(Int32& request);

  Ip440& inputs_;
  const ServerLog& log_;
  FaultNote faults_;
};

}  // namespace mpf
