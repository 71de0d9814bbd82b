// SPDX-License-Identifier: MIT
// SnapshotDelta: two snapshots taken one after the other. Their differences show message rates, and
// processes that make no progress.
//
// Threads  one.
#pragma once

#include <string>
#include <unordered_map>

#include <mpf/clock.h>

#include "tools/report/snapshot.h"

namespace mpf::tools {

struct Rates {
  double sentPerSecond = 0;
  double receivedPerSecond = 0;
};

// The rates of a router's connection.
struct LineRates {
  Rates messages;
  Rates frames;  // each frame that is sent is one write
  Rates bytes;
};

class SnapshotDelta {
 public:
  // Snapshots now, and again after `interval`.
  SnapshotDelta(const std::string& backplane, Nanoseconds interval);
  SnapshotDelta(Snapshot before, Snapshot now);
  SnapshotDelta(const SnapshotDelta&) = delete;
  SnapshotDelta& operator=(const SnapshotDelta&) = delete;

  [[nodiscard]] const Snapshot& now() const noexcept { return now_; }
  // A window in the second snapshot; null when it is not there.
  [[nodiscard]] const WindowView* find(std::uint64_t incarnation) const;
  // Message rates of a window. For client windows: requests sent, replies received.
  [[nodiscard]] Rates ratesOf(const WindowView& window) const;
  // Message rates of a link: requests sent by its client, replies sent by its server.
  [[nodiscard]] Rates ratesOf(const LinkView& link) const;
  [[nodiscard]] LineRates ratesOf(const RouterView& router, const RouterLineView& line) const;
  // The window in the first snapshot; null when it was not there.
  [[nodiscard]] const WindowView* before(const WindowView& window) const;
  // "dead"; "stopped" when a signal or a debugger has stopped the process; "closed"; "busy" when it
  // worked on one request during the whole time between the snapshots; "stalled" when messages wait
  // for it and it received none in that time; otherwise "alive".
  [[nodiscard]] std::string stateOf(const WindowView& window) const;
  // What a busy server works on, and for how long: "char8Array cmd=3 for 35.2 s". Empty when it is
  // not busy.
  [[nodiscard]] std::string workOf(const WindowView& window) const;
  [[nodiscard]] bool isBusy(const WindowView& window) const;
  // "alive", "stopped", "dead".
  [[nodiscard]] std::string stateOf(const RouterView& router) const;
  // The state of the router if it is not alive; otherwise "connected", "connecting", "waiting" (for
  // the next attempt).
  [[nodiscard]] std::string stateOf(const RouterView& router, const RouterLineView& line) const;

  // The connection that a window of a router is for (WindowView::router); null for other windows.
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

// "char8Array cmd=3 for 35.2 s".
[[nodiscard]] std::string workText(const Handling& handling, std::int64_t forNs);

// The samples that a histogram gained between two snapshots. The maximum is that of `is`, because
// the maximum of the new samples alone is not known.
[[nodiscard]] Latencies between(const Latencies& was, const Latencies& is) noexcept;

// The sums over all links of a window.
struct Totals {
  Traffic incoming;  // a server's requests, a client's replies
  Traffic outgoing;
  std::uint64_t refused = 0, unanswered = 0, bytes = 0;
  static Totals of(const WindowView& window) noexcept;
};

}  // namespace mpf::tools
