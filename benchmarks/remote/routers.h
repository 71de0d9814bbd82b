// SPDX-License-Identifier: MIT
// RouterPair: two mpf-router processes that join two backplanes, as two hosts would be.
//
//   server ─ backplane NAME-s ─ router ═══ TCP ═══ router ─ backplane NAME-c ─ client
//            server's CPUs and namespace           requester's CPUs and namespace
//
// The Runner starts them before the first row that needs them and stops them after the last one.
// Their output is kept and shown when a row fails.
//
// Threads  the runner's only thread.
// Crash    the kernel kills the routers when the runner dies.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "benchmarks/remote/surroundings.h"
#include "benchmarks/stage/measurement.h"
#include "benchmarks/stage/program.h"

namespace mpf::bench {

inline constexpr int kRemoteLocation = 1;

class RouterPair {
 public:
  //   program  path of mpf-router
  //   name     the names of both backplanes begin with it
  RouterPair(std::string program, std::string name, Placement placement, Surroundings between);
  ~RouterPair() { stop(); }
  RouterPair(const RouterPair&) = delete;
  RouterPair& operator=(const RouterPair&) = delete;

  // Throws std::runtime_error with the last output of a router that does not start.
  void start();
  void stop() noexcept;

  [[nodiscard]] int serverPid() const noexcept { return server_.program.pid(); }
  [[nodiscard]] int clientPid() const noexcept { return client_.program.pid(); }
  [[nodiscard]] std::string serverBackplane() const { return name_ + "-s"; }
  [[nodiscard]] std::string clientBackplane() const { return name_ + "-c"; }

  // Runs `row`. Adds to an error whether a router has ended, or the last output of the client's
  // router. When a router has ended before, `row` is not run.
  [[nodiscard]] Outcome run(const std::function<Outcome()>& row);

 private:
  struct Router {
    const char* side;
    Program program;
  };
  [[nodiscard]] std::string complaint();

  std::string program_, name_;
  Placement placement_;
  Surroundings between_;
  Router server_{"the server's router", {}};
  Router client_{"the client's router", {}};
};

// The path of mpf-router, in the folder of this program.
[[nodiscard]] std::string routerProgram();

}  // namespace mpf::bench
