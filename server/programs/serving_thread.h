// SPDX-License-Identifier: MIT
// ServingThread: a thread that serves. When that ends by an exception, the log says why and the
// program ends: a window that stays open while nobody serves it would take requests and never
// answer them.
//
//   ProgramFailure failure;                                        // main()'s
//   ServingThread thread;
//   thread.start(log, [&] { server.run(); }, [&] { failure.report(); });
//   ... wait for SIGINT or SIGTERM, stop the server ...
//   thread.join();
//   return failure.exitStatus();
//
// Threads  one starts and joins it.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "server/programs/server_log.h"

namespace mpf {

class ServingThread {
 public:
  ServingThread() = default;
  ~ServingThread() { join(); }
  ServingThread(const ServingThread&) = delete;
  ServingThread& operator=(const ServingThread&) = delete;

  // `serve` runs with all signals blocked, until whoever started it has told it to return; `failed`
  // after it has thrown.
  //   log  outlives the thread
  void start(const ServerLog& log, std::function<void()> serve, std::function<void()> failed);
  // Waits for its end; returns at once when it was not started.
  void join();

 private:
  std::thread thread_;
};

// Ends the program as SIGTERM does, but for the exit status.
class ProgramFailure {
 public:
  void report() noexcept;
  [[nodiscard]] int exitStatus() const noexcept {
    return isReported_.load(std::memory_order_relaxed) ? 1 : 0;
  }

 private:
  std::atomic<bool> isReported_{false};
};

}  // namespace mpf
