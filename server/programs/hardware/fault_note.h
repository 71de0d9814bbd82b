// SPDX-License-Identifier: MIT
// FaultNote: counts the faults of a module as alarms, and logs when a series of faults begins and
// ends. It does not log each fault: there may be thousands.
//
// Threads  one.
#pragma once

#include <utility>

#include <mpf/message_server.h>

#include "server/programs/server_log.h"

namespace mpf {

class FaultNote {
 public:
  // Both must outlive this.
  FaultNote(MessageServer& server, const ServerLog& log) : server_(server), log_(log) {}

  // Counts and logs a fault that is already over.
  void alarm(const char* what) {
    server_.countAlarm();
    log_->warn("{}", what);
  }
  void success() {
    if (std::exchange(isFailing_, false)) log_->info("requests succeed again");
  }
  void fault(const char* because) {
    server_.countAlarm();
    if (!std::exchange(isFailing_, true)) log_->warn("requests fail: {}", because);
  }

 private:
  MessageServer& server_;
  const ServerLog& log_;
  bool isFailing_ = false;
};

}  // namespace mpf
