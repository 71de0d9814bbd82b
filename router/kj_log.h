// SPDX-License-Identifier: MIT
// KjLog: what kj reports by itself goes to the router's log instead of stderr, in the thread that
// made it and in the threads that kj starts there for look-ups of names.
//
// A look-up that nobody waits for any more cannot be stopped. Its thread finds its pipe closed at
// the end, and kj would report that as an error of a detached thread: such an exception ends here.
//
// Threads  one makes it, on its stack (kj requires that).
#pragma once

#include <kj/exception.h>
#include <kj/function.h>

#include "server/programs/log.h"

namespace mpf::router {

// For functions that make a KjLog: AddressSanitizer may put the variables of others beside the
// stack, where kj refuses it.
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
