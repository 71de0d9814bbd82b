// SPDX-License-Identifier: MIT
// Snapshot: the contents of the segments of a backplane at one moment. Every report of `mpf` is
// made from snapshots.
//
//   /dev/shm/mpf.<backplane>.* ─ pread ─► Snapshot ─► ls, mrr, msr, top, inspect
//
// Threads  one.
// Crash    works while processes hang or are dead: it waits for no process and changes nothing.
// Trust    a segment that cannot be read is listed as a problem; the others are shown.
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
// How the owner of a window waits: "awake", "asleep on its futex", "asleep on its pipe".
[[nodiscard]] const char* toString(layout::SleepState state) noexcept;
// "spin", "adaptive", "block".
[[nodiscard]] const char* waitModeName(std::uint32_t mode) noexcept;

// A latency histogram of a window.
struct Latencies {
  std::array<std::uint64_t, layout::kHistogramBuckets> buckets{};
  std::uint64_t count = 0;
  std::uint64_t maxNs = 0;
  [[nodiscard]] static Latencies of(const layout::Histogram& histogram) noexcept;
  // Upper end of the bucket that contains the percentile, at most maxNs; 0 without samples.
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
  std::uint64_t serverWindow = 0;  // incarnation
  std::uint64_t clientWindow = 0;  // incarnation
  std::string server;
  std::int32_t location = 0;
  layout::LinkState clientState{};
  layout::LinkState serverState{};
  std::uint32_t clientIndex = 0;  // its bit in the client's ready bits, and in the server's
  std::uint32_t serverIndex = 0;
  bool isPolledByClient = false;  // the client polls the link, so its ready bit is not needed
  bool isPolledByServer = false;
  std::uint32_t queueSize = 0;
  Traffic requests;
  Traffic replies;
  std::uint64_t refused = 0;  // sends of the client that failed: queue full, too large
  std::uint64_t unanswered = 0;  // requests without a reply or fate
  std::uint64_t bytes = 0;  // shared memory, including the pools
  [[nodiscard]] bool isOpen() const noexcept {
    return clientState == layout::LinkState::open && serverState == layout::LinkState::open;
  }
};

// A client that waits for an absent server.
struct PendingBindView {
  std::uint64_t clientWindow = 0;
  std::string server;
  std::int32_t location = 0;
};

// The hints that peers wrote for a window. They are untrusted: a hint may be lost or wrong.
struct HintsView {
  std::uint32_t bell = 0;  // incremented by every ring of the doorbell
  bool isRescanDue = false;  // a knock was overwritten
  std::vector<std::uint64_t> knocks;  // incarnations of links that wait to be accepted
  std::vector<std::uint32_t> ready;  // indices of links that have new messages
  [[nodiscard]] bool isReady(std::uint32_t index) const noexcept;
  [[nodiscard]] bool hasKnocked(std::uint64_t link) const noexcept;
};

// A server or a client process's window.
struct WindowView {
  std::string file;  // name of the segment
  bool isServer = false;
  std::uint64_t incarnation = 0;
  std::string name;  // name of the server; label or program of the client
  std::int32_t location = 0;
  std::int32_t pid = 0;
  Owner owner;
  std::string program;
  std::uint32_t waitMode = 0;
  Life life{};
  layout::SleepState sleeping{};
  HintsView hints;
  char processState = '?';  // of /proc/<pid>/stat; '?' when it is unknown
  std::int64_t ageNs = 0;
  std::uint32_t queueSize = 0;
  std::uint64_t maxMessageBytes = 0;
  std::uint64_t received = 0, sent = 0, replyQueueFull = 0, queueFull = 0, expired = 0, refused = 0,
                wakes = 0;
  std::uint64_t linksOpened = 0, linksClosed = 0, peersDied = 0, protocolErrors = 0, alarms = 0;
  std::optional<Handling> handling;  // the request that a server works on
  std::int64_t progressAtNs = 0;  // CLOCK_MONOTONIC: earliest time at which `handling` began
  std::uint64_t fanOutBytes = 0;  // shared memory of the fan-out pool of a server
  Latencies queueWait;
  Latencies service;
  std::vector<LinkView> links;  // sorted by location, server and incarnation
  std::vector<PendingBindView> pendingBinds;  // of a client; sorted by location and server
  // For a window that a router has for a server or client on another host: the incarnation of the
  // router's segment and the row of the connection. 0: not a window of a router, or the connection
  // is not certain.
  std::uint64_t router = 0;
  std::size_t routerRow = 0;
};

struct Snapshot {
  std::string backplane;
  std::int64_t atNs = 0;  // CLOCK_MONOTONIC
  std::vector<WindowView> servers;  // sorted by location and name
  std::vector<WindowView> clients;  // sorted by age
  std::vector<PendingBindView> pendingBinds;  // sorted by location and server
  std::vector<RouterView> routers;  // sorted by name and incarnation
  std::size_t files = 0;  // all files whose names belong to this backplane
  std::uint64_t bytes = 0;  // shared memory of the segments that could be read
  std::vector<std::string> problems;  // segments that could not be read, and why

  // Throws std::invalid_argument for a name that no backplane can have.
  static Snapshot take(const std::string& backplane);
};

}  // namespace mpf::tools
