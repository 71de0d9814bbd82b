// SPDX-License-Identifier: MIT
// RouterPair: two mpf-router processes that join two backplanes, as two hosts would be.
//
//   server ─ backplane NAME-s ─ router ═══ TCP ═══ router ─ backplane NAME-c ─ client
//            server's CPUs and namespace           requester's CPUs and namespace
//
// Started when the first row needs them, and stopped after the last one that does (Runner). What
// they say on stderr is kept, and told when a row fails.
//
// Threads  the runner's only one.
// Crash    the routers die with the runner, by the kernel.
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
  //   name     begins the names of both backplanes
  RouterPair(std::string program, std::string name, Placement placement, Surroundings between);
  ~RouterPair() { stop(); }
  RouterPair(const RouterPair&) = delete;
  RouterPair& operator=(const RouterPair&) = delete;

  // Throws std::runtime_error with what a router said, when it does not come up.
  void start();
  void stop() noexcept;

  [[nodiscard]] int serverPid() const noexcept { return server_.program.pid(); }
  [[nodiscard]] int clientPid() const noexcept { return client_.program.pid(); }
  [[nodiscard]] std::string serverBackplane() const { return name_ + "-s"; }
  [[nodiscard]] std::string clientBackplane() const { return name_ + "-c"; }

  // Runs `row`, and says of a failure what the routers have to do with it. When one of them has
  // ended, it is not run at all.
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

// mpf-router, beside this program.
[[nodiscard]] std::string routerProgram();

}  // namespace mpf::bench
