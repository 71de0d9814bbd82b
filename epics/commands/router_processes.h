// SPDX-License-Identifier: MIT
// RouterProcesses: the routers that commands of the startup file started. Each is a process
// mpf-router, which is started again when it ends, and which ends with the IOC.
//
//   running ── exit, signal ──► pause 1 s, 2 s, 4 s ... 30 s ──► running
//      │                                     │
//      └── invalid arguments (status 2) ─────┴── end() ──► ended
//
// Threads  any; each router has a thread.
// Crash    the kernel ends the routers of an IOC that is killed.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace mpf {

class RouterProcesses {
 public:
  // Those of this process. They end with it (epicsAtExit).
  static RouterProcesses& instance();

  // Starts a router that connects to the location of another host. A second call for the same
  // location has no effect, because startup files repeat their commands.
  //   address    HOST:PORT
  //   options    further options of mpf-router; empty: --plain
  void connect(std::int32_t location, const std::string& address,
               const std::vector<std::string>& options);
  // Ends all routers.
  void end();

 private:
  void run(const std::stop_token& stop, const std::vector<std::string>& arguments);

  std::mutex mutex_;
  std::condition_variable_any ended_;
  std::map<std::int32_t, std::jthread> threads_;  // by location
};

}  // namespace mpf
