// SPDX-License-Identifier: MIT
// SnapshotDelta: two snapshots with some time between them, which tell what one cannot: rates, and
// who has stopped moving.
//
// Threads  one.
#pragma once

#include <chrono>
#include <string>
#include <unordered_map>

#include "tools/report/snapshot.h"

namespace mpf::tools {

struct Rates {
  double sentPerSecond = 0;
  double receivedPerSecond = 0;
};

// Of a router's connection.
struct LineRates {
  Rates messages;
  Rates frames;  // each one sent is one write
  Rates bytes;
};

class SnapshotDelta {
 public:
  // Snapshots now, and again after `interval`.
  SnapshotDelta(const std::string& backplane, std::chrono::milliseconds interval);
  SnapshotDelta(Snapshot before, Snapshot now);
  SnapshotDelta(const SnapshotDelta&) = delete;
  SnapshotDelta& operator=(const SnapshotDelta&) = delete;

  [[nodiscard]] const Snapshot& now() const noexcept { return now_; }
  // A window as it is now; null when there is none.
  [[nodiscard]] const WindowView* find(std::uint64_t incarnation) const;
  // Messages of a window in either direction. Client windows: requests sent, replies received.
  [[nodiscard]] Rates ratesOf(const WindowView& window) const;
  // The same of a link, as its client sees it.
  [[nodiscard]] Rates ratesOf(const LinkView& link) const;
  [[nodiscard]] LineRates ratesOf(const RouterView& router, const RouterLineView& line) const;
  // The window as it was at the first look; null when it was not there.
  [[nodiscard]] const WindowView* before(const WindowView& window) const;
  // "alive", "closed", "dead"; of the living "busy" when it worked on one request all the time
  // between the snapshots, "stalled" when messages wait for it and it took none, and "stopped" when
  // its process is, by a signal or a debugger.
  [[nodiscard]] std::string stateOf(const WindowView& window) const;
  // What a busy server works on, and for how long: "char8Array cmd=3 for 35.2 s". Empty when it is
  // not busy.
  [[nodiscard]] std::string workOf(const WindowView& window) const;
  [[nodiscard]] bool isBusy(const WindowView& window) const;
  // "alive", "stopped", "dead".
  [[nodiscard]] std::string stateOf(const RouterView& router) const;
  // The same of a router that does not live; else "connected", "connecting", "waiting" (to try
  // again).
  [[nodiscard]] std::string stateOf(const RouterView& router, const RouterLineView& line) const;

  // The connection that a window of a router is for (WindowView::router); null when there is none.
  struct RouterLineOf {
    const RouterView* router = nullptr;
    const RouterLineView* line = nullptr;
    explicit operator bool() const noexcept { return line != nullptr; }
  };
  [[nodiscard]] RouterLineOf routerOf(const WindowView& window) const;

 private:
  using Windows = std::unordered_map<std::uint64_t, const WindowView*>;  // by incarnation
  static Windows windowsOf(const Snapshot& snapshot);
  [[nodiscard]] bool isStalled(const WindowView& window) const;
  Snapshot before_;
  Snapshot now_;
  Windows windowsBefore_;
  Windows windowsNow_;
  std::unordered_map<std::uint64_t, const LinkView*> linksBefore_;  // by incarnation
};

// What was sampled between two looks at a histogram. Its longest is that of all times.
[[nodiscard]] Latencies between(const Latencies& was, const Latencies& is) noexcept;

// What goes into a window and what comes out of it, over all of its links.
struct Totals {
  Traffic incoming;  // a server's requests, a client's replies
  Traffic outgoing;
  std::uint64_t refused = 0, unanswered = 0, bytes = 0;
  static Totals of(const WindowView& window) noexcept;
};

}  // namespace mpf::tools
