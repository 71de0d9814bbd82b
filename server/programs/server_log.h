// SPDX-License-Identifier: MIT
// ServerLog: what a server program says to people, on stderr.
//
//   2024-05-01 12:00:00.000 info mpf-serial-server: /dev/ttyS0 is lost: read /dev/ttyS0:
//   Input/output error
//
//   threads ─► Log (limits lines of one kind) ─► queue ─► one thread ─► stderr
//
// Threads  any may log; none waits for stderr. When nobody reads stderr, the oldest lines in the
//          queue are dropped, and a line says how many.
// Crash    lines in the queue, and lines that the limit holds, are lost.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/programs/log.h"

namespace mpf {

class ServerLog {
 public:
  // `level`: one of levels().
  ServerLog(const std::string& program, const std::string& level);
  // Writes everything that was logged.
  ~ServerLog();
  ServerLog(const ServerLog&) = delete;
  ServerLog& operator=(const ServerLog&) = delete;

  // log->info("{} is back", port);
  const Log* operator->() const noexcept { return &log_; }
  const Log& operator*() const noexcept { return log_; }

  // trace, debug, info, warning, error, critical, off.
  static const std::vector<std::string>& levels();

 private:
  class Writer;
  std::shared_ptr<Writer> writer_;
  Log log_;
};

class MessageServer;

// Says when `server` cannot accept clients for lack of descriptors or memory, and when it can
// again.
//   log  outlives the server
void logShortages(MessageServer& server, const ServerLog& log);

}  // namespace mpf
