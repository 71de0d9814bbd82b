// SPDX-License-Identifier: MIT
// GhostServer: a server that replies as a recorded one did, with its delays, refusals and silences.
//
//   request ─► GhostScript ─► replies, each at its time ─► the client
//                         └─► no recorded request is like it: refused, and counted
//
// A reply that has a time stamp gets the one that the server would give now.
//
// Threads  one; any thread may call stop().
#pragma once

#include <atomic>
#include <cstdint>
#include <list>
#include <map>

#include <mpf/message_server.h>

#include "tools/tap/ghost_script.h"

namespace mpf::tools {

struct GhostCounts {
  std::uint64_t requests = 0;
  std::uint64_t similar = 0;  // no recorded request was the same, but for its value and timeout
  std::uint64_t unknown = 0;  // refused: no recorded request was like them
  std::uint64_t silent = 0;  // not answered, as in the recording
  std::uint64_t replies = 0;
};

class GhostServer {
 public:
  //   speed   2: with half of the delays; 0: without delays
  //   throws  as MessageServer
  GhostServer(const Backplane& backplane, const std::string& name, const ServerOptions& options,
              GhostScript& script, double speed)
      : script_(script), speed_(speed), server_(backplane, name, options) {}

  // Serves until stop().
  void run();
  // Async-signal-safe.
  void stop() noexcept {
    stopped_.store(true);
    server_.interrupt();
  }
  [[nodiscard]] const GhostCounts& counts() const noexcept { return counts_; }

 private:
  // A request whose replies are not all sent.
  struct Answering {
    Message request;
    const GhostExchange* exchange;
    std::int64_t beginNs;  // CLOCK_MONOTONIC of the request
    std::size_t next = 0;  // the reply to send
  };

  void take(Message&& request);
  void schedule(Answering&& answering);
  [[nodiscard]] std::int64_t dueNs(const Answering& answering) const;
  void sendDue();
  // False when the client does not receive its earlier replies.
  bool trySend(Answering& answering);
  void forgetGone();

  GhostScript& script_;
  const double speed_;
  GhostCounts counts_;
  std::atomic<bool> stopped_{false};
  std::multimap<std::int64_t, Answering> due_;  // by time, CLOCK_MONOTONIC
  std::list<Message> silent_;  // requests that get no reply
  MessageServer server_;  // destroyed first: the requests above end with it
};

}  // namespace mpf::tools
