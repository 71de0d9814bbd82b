// SPDX-License-Identifier: MIT
// KjLog: writes the messages of kj to the router's log instead of stderr, for the thread that
// creates it and for the threads that kj starts from there for name look-ups.
//
// A name look-up that has been cancelled cannot be stopped. At its end its thread finds its pipe
// closed, which kj would report as an error of a detached thread; KjLog catches that exception.
//
// Threads  one thread creates it, on its stack (kj requires that).
#pragma once

#include <kj/exception.h>
#include <kj/function.h>

#include "server/programs/log.h"

namespace mpf::router {

// For functions that create a KjLog. AddressSanitizer may place local variables outside of the
// stack, where kj refuses them.
#define MPF_KEEPS_KJ_LOG [[gnu::no_sanitize_address, gnu::noinline]]

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"
class KjLog final : public kj::ExceptionCallback {
 public:
  explicit KjLog(Log log) : log_(std::move(log)) {}

  void logMessage(kj::LogSeverity severity, const char* file, int line, int contextDepth,
                  kj::String&& text) override;
  kj::Function<void(kj::Function<void()>)> getThreadInitializer() override;

 private:
  Log log_;
};
#pragma GCC diagnostic pop

}  // namespace mpf::router
