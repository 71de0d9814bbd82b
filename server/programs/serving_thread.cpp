// SPDX-License-Identifier: MIT
#include "server/programs/serving_thread.h"

#include <signal.h>
#include <unistd.h>

#include <exception>
#include <utility>

#include "base/signals_blocked.h"

namespace mpf {

void ServingThread::start(const ServerLog& log, std::function<void()> serve,
                          std::function<void()> failed) {
  const SignalsBlocked blocked;
  thread_ = std::thread([&log, serve = std::move(serve), failed = std::move(failed)] {
    try {
      return serve();
    } catch (const std::exception& error) {
      log->critical("{}", error.what());
    } catch (...) {
      log->critical("the server failed: it threw an exception that is not a std::exception");
    }
    failed();
  });
}

void ServingThread::join() {
  if (thread_.joinable()) thread_.join();
}

void ProgramFailure::report() noexcept {
  isReported_.store(true, std::memory_order_relaxed);
  ::kill(::getpid(), SIGTERM);
}

}  // namespace mpf
