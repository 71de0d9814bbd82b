// SPDX-License-Identifier: MIT
// ErrorLog: the messages that an IOC logs while the object exists.
#pragma once

#include <errlog.h>
#include <mutex>
#include <string>

namespace mpf::test {

class ErrorLog {
 public:
  ErrorLog() { errlogAddListener(onMessage, this); }
  ~ErrorLog() { errlogRemoveListeners(onMessage, this); }
  ErrorLog(const ErrorLog&) = delete;
  ErrorLog& operator=(const ErrorLog&) = delete;

  // All messages so far.
  std::string text() {
    errlogFlush();
    const std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  static void onMessage(void* self, const char* message) {
    auto& log = *static_cast<ErrorLog*>(self);
    const std::lock_guard lock(log.mutex_);
    log.text_ += message;
  }
  std::mutex mutex_;
  std::string text_;  // under mutex_
};

}  // namespace mpf::test
