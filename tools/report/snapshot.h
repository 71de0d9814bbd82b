// SPDX-License-Identifier: MIT
// Snapshot: what the segments of a backplane say at one moment. What every report of `mpf` is made
// from.
//
//   /dev/shm/mpf.<backplane>.* ─ pread ─► Snapshot ─► ls, mrr, msr, top, inspect
//
// Threads  one.
// Crash    works on a wedged system: it waits for nobody, and nobody notices it.
// Trust    a segment that cannot be read is a problem by name; the rest is shown all the same.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shm/handling.h"
#include "tools/report/router_view.h"

namespace mpf::tools {

// "none" (not yet), "open", "closed", "refused".
[[nodiscard]] const char* toString(layout::LinkState state) noexcept;
// What an owner does about news: "awake", "asleep on its futex", "asleep on its pipe".
[[nodiscard]] const char* toString(layout::SleepState state) noexcept;
// "spin", "adaptive", "block".
[[nodiscard]] const char* waitModeName(std::uint32_t mode) noexcept;

// A latency histogram of a window.
struct Latencies {
  std::array<std::uint64_t, layout::kHistogramBuckets> buckets{};
  std::uint64_t count = 0;
  std::uint64_t maxNs = 0;
  // Upper end of the bucket that holds the percentile, at most maxNs; 0 without samples.
  [[nodiscard]] std::uint64_t percentileNs(double percent) const noexcept;
};

// Messages of one direction of a link.
struct Traffic {
  std::uint64_t sent = 0;
  std::uint64_t taken = 0;
  [[nodiscard]] std::uint64_t waiting() const noexcept { return sent > taken ? sent - taken : 0; }
};

struct LinkView {
  std::string file;  // name of the segment
  std::uint64_t incarnation = 0;
  std::uint64_t serverWindow = 0;  // incarnations
  std::uint64_t clientWindow = 0;
  std::string server;
  std::int32_t location = 0;
  layout::LinkState clientState{};
  layout::LinkState serverState{};
  std::uint32_t clientIndex = 0;  // its bit in the client's ready bits, and in the server's
  std::uint32_t serverIndex = 0;
  bool isPolledByClient = false;  // the receiver looks by itself: it needs no ready bit
  bool isPolledByServer = false;
  std::uint32_t queueSize = 0;
  Traffic requests;
  Traffic replies;
  std::uint64_t refused = 0;  // sends that the client was refused: queue full, too large
  std::uint64_t unanswered = 0;  // requests without a reply or fate
  std::uint64_t bytes = 0;  // shared memory, pools included
  [[nodiscard]] bool isOpen() const noexcept {
    return clientState == layout::LinkState::open && serverState == layout::LinkState::open;
  }
};

// A client that waits for a server that is not there.
struct PendingBindView {
  std::uint64_t clientWindow = 0;
  std::string server;
  std::int32_t location = 0;
};

// What peers told a window: hints, which may be lost or invented.
struct HintsView {
  std::uint32_t bell = 0;  // grows with every ring
  bool isRescanDue = false;  // a knock was overwritten
  std::vector<std::uint64_t> knocks;  // incarnations of links that wait to be accepted
  std::vector<std::uint32_t> ready;  // indices of links that have news
  [[nodiscard]] bool isReady(std::uint32_t index) const noexcept;
  [[nodiscard]] bool hasKnocked(std::uint64_t link) const noexcept;
};

// A server or a client process's window.
struct WindowView {
  std::string file;  // name of the segment
  bool isServer = false;
  std::uint64_t incarnation = 0;
  std::string name;  // the server's; a client's label or program
  std::int32_t location = 0;
  std::int32_t pid = 0;
  Owner owner;
  std::string program;
  std::uint32_t waitMode = 0;
  Life life{};
  layout::SleepState sleeping{};
  HintsView hints;
  char processState = '?';  // of /proc/<pid>/stat; '?' when it cannot be told
  std::int64_t ageNs = 0;
  std::uint32_t queueSize = 0;
  std::uint64_t maxMessageBytes = 0;
  std::uint64_t received = 0, sent = 0, replyQueueFull = 0, queueFull = 0, expired = 0, refused = 0,
                wakes = 0;
  std::uint64_t linksOpened = 0, linksClosed = 0, peersDied = 0, protocolErrors = 0, alarms = 0;
  std::optional<Handling> handling;  // the request that a server works on
  std::int64_t progressAtNs = 0;  // CLOCK_MONOTONIC: since when, at the earliest
  Latencies queueWait;
  Latencies service;
  std::vector<LinkView> links;  // by location, server and incarnation
  std::vector<PendingBindView> pendingBinds;  // of a client; by location and server
  // Of a router's process: incarnation of the router's segment and row of the connection that it is
  // for. A server here that is elsewhere; a client elsewhere.
  std::uint64_t router = 0;  // 0: of no router's process, or of no connection that is certain
  std::size_t routerRow = 0;
};

struct Snapshot {
  std::string backplane;
  std::int64_t atNs = 0;  // CLOCK_MONOTONIC
  std::vector<WindowView> servers;  // by location and name
  std::vector<WindowView> clients;  // by age
  std::vector<PendingBindView> pendingBinds;  // by location and server
  std::vector<RouterView> routers;  // by name and incarnation
  std::size_t files = 0;  // all that have a name of this backplane
  std::uint64_t bytes = 0;  // shared memory of those that could be read
  std::vector<std::string> problems;  // segments that could not be read, and why

  // Throws std::invalid_argument for a name that no backplane can have.
  static Snapshot take(const std::string& backplane);
};

}  // namespace mpf::tools
