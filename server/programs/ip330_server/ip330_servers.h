// SPDX-License-Identifier: MIT
// Ip330Servers: a board and all its servers, each on its own thread.
//
//   scan, config, sweep, PID servers ──► Ip330Scan, Ip330Sweep, Ip330Pid ──► Ip330 ──► registers
//                                                              └──► a DAC128V
//   faults of the boards ──► stderr, and an alarm of every server
//
// Threads  one thread calls add...(), at start. Each server has a thread, and the board has two.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <mpf/drivers/dac128v.h>
#include <mpf/message_server.h>

#include "drivers/ip330/ip330.h"
#include "drivers/ip330/ip330_scan.h"
#include "server/programs/server_log.h"
#include "server/programs/serving_thread.h"

namespace mpf {

class Ip330Servers {
 public:
  // `backplane`, `module` and `log` must outlive this.
  //   options  of each server, except for the length of its queue
  //   failed   called by the thread of a server that has failed, after it has logged the error
  //   throws   as Ip330
  Ip330Servers(
      const Backplane& backplane, const ServerOptions& options, IndustryPackModule& module,
      const Ip330Settings& settings, const ServerLog& log, const Ip330Limits& limits = {},
      std::function<void()> failed = [] {});
  // Stops the servers and the board. Requests that wait for a sample get status -1.
  ~Ip330Servers();
  Ip330Servers(const Ip330Servers&) = delete;
  Ip330Servers& operator=(const Ip330Servers&) = delete;

  [[nodiscard]] Ip330& board() noexcept { return *board_; }

  // Each throws as MessageServer, and std::invalid_argument when the board does not scan such
  // channels.
  void addScan(const std::string& name, int queueSize, int first, int last,
               std::chrono::milliseconds average);
  void addConfig(const std::string& name, int queueSize);
  void addSweep(const std::string& name, int queueSize, int first, int last, int maxPoints);
  // `dac` must outlive this.
  void addPid(const std::string& name, int queueSize, int channel, Dac128v& dac, int dacChannel);

  // The names of all servers, for messages to people: "a", "b", "c".
  [[nodiscard]] std::string names() const;

 private:
  // A server with its device and its thread.
  struct Unit {
    std::shared_ptr<void> device;  // Ip330Scan, ...
    std::unique_ptr<MessageServer> server;
    std::shared_ptr<void> logic;  // Ip330ScanServer, ...
    std::function<void()> stop;  // ends a wait of the thread for the device
    ServingThread thread;
  };

  Unit& addUnit(const std::string& name, int queueSize);
  void serve(Unit& unit);
  void note(const std::string& text, bool isThere);

  const Backplane& backplane_;
  const ServerOptions options_;
  const ServerLog& log_;
  const std::function<void()> failed_;
  std::mutex mutex_;
  std::vector<MessageServer*> alarmed_;  // under mutex_: the board's threads report faults
  std::unique_ptr<Ip330> board_;
  std::vector<std::unique_ptr<Unit>> units_;
};

}  // namespace mpf
