// SPDX-License-Identifier: MIT
// ServingThread: a thread that runs a server. When the server throws an exception, the thread logs
// it and ends the program: otherwise the server would still accept requests and never reply.
//
//   ProgramFailure failure;                                        // in main()
//   ServingThread thread;
//   thread.start(log, [&] { server.run(); }, [&] { failure.report(); });
//   ... wait for SIGINT or SIGTERM, stop the server ...
//   thread.join();
//   return failure.exitStatus();
//
// Threads  one thread starts and joins it.
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

  // Runs `serve`, with all signals blocked, in a new thread, and `failed` if `serve` has thrown.
  // The caller must make `serve` return before join().
  //   log  outlives the thread
  void start(const ServerLog& log, std::function<void()> serve, std::function<void()> failed);
  // Waits until the thread has ended; returns immediately when it was not started.
  void join();

 private:
  std::thread thread_;
};

// Ends the program as SIGTERM does, with exit status 1.
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
