// SPDX-License-Identifier: MIT
// FaultNote: counts the faults of a module for `mpf msr`, and says on stderr when they begin and
// end; not each, for there may be thousands.
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

  // What happened once and is over.
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
