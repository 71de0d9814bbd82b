// SPDX-License-Identifier: MIT
// ServerLog: the log of a server program, on stderr.
//
//   2024-05-01 12:00:00.000 info mpf-serial-server: the line is connected
//
//   threads ─► Log (limits lines of one kind) ─► queue ─► one thread ─► stderr
//
// Threads  any thread may log, and no thread waits for stderr. When stderr is not read, the queue
//          drops its oldest lines, and a line reports their number.
// Crash    lines in the queue, and lines that the limit holds back, are lost. Without memory, lines
//          may be lost, too; the program continues.
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
  // Writes all lines that were logged.
  ~ServerLog();
  ServerLog(const ServerLog&) = delete;
  ServerLog& operator=(const ServerLog&) = delete;

  // log->info("{} is connected", port);
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

// Logs when `server` lacks descriptors, memory or threads to accept clients, and when it can again.
void logShortages(MessageServer& server, const Log& log);

}  // namespace mpf
