// SPDX-License-Identifier: MIT
// ServerFarm: 50 server processes, which the requester of a row may kill, stop and start again. A
// keeper, the server's process of the Stage, forks them, because the requester has threads.
//
//   requester ── kill(pid) ──► server ── reaped by the keeper ──► pid 0
//        └────── restart() ──► keeper ── fork ──► server, pid
//
// All processes share the table in RunContext::scratch().
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "benchmarks/epics/epics.h"
#include "benchmarks/stage/stage.h"

namespace mpf::bench {

class ServerFarm {
 public:
  static constexpr int kServers = 50;
  static constexpr std::size_t kScratchBytes = 4096;

  explicit ServerFarm(const RunContext& context)
      : places_(reinterpret_cast<Place*>(context.scratch().data())) {}

  // Keeper: starts all servers and then those that restart() asks for. Does not return.
  void keep(const RunContext& context, const EpicsBench& bench);

  // Sends a signal to a server that runs.
  void signal(int server, int number) const;
  // Asks the keeper to start a server that was killed.
  void restart(int server);
  [[nodiscard]] bool isRunning(int server) const { return places_[server].pid != 0; }
  // Requests that the server has answered.
  [[nodiscard]] std::uint64_t answered(int server) const { return places_[server].answered; }
  [[nodiscard]] static std::string nameOf(int server) { return "s" + std::to_string(server); }

 private:
  struct Place {
    std::atomic<int> pid{0};
    std::atomic<bool> isWanted{false};
    std::atomic<std::uint64_t> answered{0};
  };
  static_assert(sizeof(Place) * kServers <= kScratchBytes);
  void start(int server, const EpicsBench& bench);
  void reap();

  Place* places_;
};

}  // namespace mpf::bench
