// SPDX-License-Identifier: MIT
// Ip330SweepServer: a digitiser, for clients of the mca record. Ip330PidServer: fast feedback, for
// clients of the epid record. Their commands are in include/mpf/ip330_commands.h.
//
// Threads  the thread of its server.
#pragma once

#include <mpf/message_server.h>

#include "drivers/ip330/ip330_pid.h"
#include "drivers/ip330/ip330_sweep.h"
#include "server/programs/server_log.h"

namespace mpf {

class Ip330SweepServer {
 public:
  // Handles every request of `server`. The arguments must outlive this object.
  Ip330SweepServer(MessageServer& server, Ip330& board, Ip330Sweep& sweep, const ServerLog& log);

 private:
  void handle(Float64Message&& request);
  [[nodiscard]] bool sendPoints(const Float64Message& request);
  [[nodiscard]] bool sendStatus(const Float64Message& request);
  [[nodiscard]] bool tryDo(std::int32_t command, double value);

  MessageServer& server_;
  Ip330& board_;
  Ip330Sweep& sweep_;
};

class Ip330PidServer {
 public:
  Ip330PidServer(MessageServer& server, Ip330Pid& pid, const ServerLog& log);

 private:
  void handle(Float64Message&& request);
  [[nodiscard]] bool sendParams(const Float64Message& request);
  [[nodiscard]] bool tryDo(std::int32_t command, double value);

  MessageServer& server_;
  Ip330Pid& pid_;
};

}  // namespace mpf
