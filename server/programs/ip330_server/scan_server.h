// SPDX-License-Identifier: MIT
// Ip330ScanServer: mean values of channels (manual, "ip330Scan"). Ip330ConfigServer: the scan mode
// and the calibration of the board.
//
// Threads  the thread of its server.
#pragma once

#include <chrono>

#include <mpf/message_server.h>

#include "drivers/ip330/ip330_scan.h"
#include "server/programs/server_log.h"

namespace mpf {

class Ip330ScanServer {
 public:
  // Handles every request of `server`. The arguments must outlive this object.
  //   average  averaging time of requests without one; 0: since the last such request
  Ip330ScanServer(MessageServer& server, Ip330Scan& scan, std::chrono::milliseconds average,
                  const ServerLog& log);

 private:
  void handle(Int32& request);

  Ip330Scan& scan_;
  const std::chrono::milliseconds average_;
  const ServerLog& log_;
};

class Ip330ConfigServer {
 public:
  Ip330ConfigServer(MessageServer& server, Ip330& board, const ServerLog& log);

 private:
  [[nodiscard]] bool tryDo(std::int32_t command, Int32& request);
  [[nodiscard]] bool tryConfigure(Ip330ScanMode mode, double microsecondsPerScan);

  Ip330& board_;
  const ServerLog& log_;
};

}  // namespace mpf
