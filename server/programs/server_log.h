// SPDX-License-Identifier: MIT
// ServerLog: what a server program says to people, on stderr.
//
//   2024-05-01 12:00:00.000 info mpf-serial-server: /dev/ttyS0 is lost: read /dev/ttyS0: Input/output error
//
// Threads  any may log; none waits for stderr. When nobody reads that, the oldest lines that wait are dropped.
// Crash    lines that were not written yet are lost.
#pragma once

#include <memory>
#include <spdlog/async_logger.h>
#include <spdlog/logger.h>
#include <string>
#include <vector>

namespace mpf {

class ServerLog {
 public:
  // `level`: one of levels().
  ServerLog(const std::string& program, const std::string& level);

  // log->info("{} is back", port);
  spdlog::logger* operator->() const noexcept { return logger_.get(); }

  // trace, debug, info, warning, error, critical, off.
  static const std::vector<std::string>& levels();

 private:
  std::shared_ptr<spdlog::logger> logger_;
  std::shared_ptr<spdlog::details::thread_pool> writer_;  // last: ends first, after it has written what waits
};

class MessageServer;

// Says when `server` cannot accept clients for lack of descriptors or memory, and when it can again.
//   log  outlives the server
void logShortages(MessageServer& server, const ServerLog& log);

}  // namespace mpf
