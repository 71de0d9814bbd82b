// SPDX-License-Identifier: MIT
#include "router/kj_log.h"

#include "router/transport/kj_text.h"

namespace mpf::router {

void KjLog::logMessage(kj::LogSeverity severity, const char* /*file*/, int /*line*/,
                       int /*contextDepth*/, kj::String&& text) {
  const auto said = displayText(kj::StringPtr(text));
  if (severity == kj::LogSeverity::ERROR || severity == kj::LogSeverity::FATAL)
    log_.error("Cap'n Proto: {}", said);
  else if (severity == kj::LogSeverity::WARNING) log_.warn("Cap'n Proto: {}", said);
  else log_.debug("Cap'n Proto: {}", said);
}

namespace {

MPF_KEEPS_KJ_LOG void runInThread(const Log& log, kj::Function<void()>& run) {
  const KjLog logOfThisThread(log);
  try {
    run();
  } catch (const kj::Exception& error) {
    if (error.getType() != kj::Exception::Type::DISCONNECTED) throw;
    log.debug("a name look-up ended after it had been cancelled");
  }
}

}  // namespace

kj::Function<void(kj::Function<void()>)> KjLog::getThreadInitializer() {
  return [log = log_](kj::Function<void()> run) { runInThread(log, run); };
}

}  // namespace mpf::router
