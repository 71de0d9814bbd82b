// SPDX-License-Identifier: MIT
// RouterView: the connections of a router, copied from its segment. Part of a Snapshot.
//
//   mpf.<backplane>.r.<incarnation> ─ pread ─► RouterView
//
// Each row is read again until two copies have the same texts.
//
// Threads  one.
// Crash    a router that died or was stopped while it changed a text leaves that text half changed;
//          it is shown half changed.
// Trust    texts are untrusted, and the name of a peer is sent by another host: control characters
//          are removed from them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/inspect/segment_image.h"

namespace mpf::tools {

enum class Life { alive, closed, dead };

// The process that owns a segment. A pid alone does not identify it: the kernel reuses pids.
struct Owner {
  std::int32_t pid = 0;
  std::uint64_t startTicks = 0;
  std::uint64_t pidNamespace = 0;
  static Owner of(const layout::SegmentHeader& header) noexcept {
    return {header.ownerPid, header.ownerStartTicks, header.pidNamespace};
  }
  auto operator<=>(const Owner&) const = default;
};
// The letter of field 3 of /proc/<pid>/stat; '?' when it is unknown.
[[nodiscard]] char processState(const Owner& owner);

// "waiting" (for the next attempt), "connecting", "connected".
[[nodiscard]] const char* toString(layout::RouterLineState state) noexcept;

// One connection, or one remote that the router tries to connect to.
struct RouterLineView {
  std::size_t row = 0;
  layout::RouterRole role{};
  layout::RouterLineState state{};
  bool isTls = false;
  std::int64_t sinceNs = 0;  // CLOCK_MONOTONIC: when it was last connected or disconnected
  std::uint64_t connects = 0;
  std::uint64_t queueSize = 0, inQueue = 0, queueFull = 0;
  std::uint64_t messagesSent = 0, messagesReceived = 0;
  std::uint64_t framesSent = 0, framesReceived = 0;
  std::uint64_t bytesSent = 0, bytesReceived = 0;
  std::uint64_t roundTripNs = 0;  // 0: not known
  std::uint64_t clients = 0, bindings = 0;
  std::string address, peer, program, problem;
  std::string locations;  // as the router wrote it: "1, 2"

  [[nodiscard]] bool isClient() const noexcept { return role == layout::RouterRole::client; }
  [[nodiscard]] bool isConnected() const noexcept {
    return state == layout::RouterLineState::connected;
  }
  [[nodiscard]] std::uint64_t reconnects() const noexcept {
    return connects > 1 ? connects - 1 : 0;
  }
  [[nodiscard]] std::vector<std::int32_t> locationList() const;
  // The name of the peer, or its address while the name is not known.
  [[nodiscard]] const std::string& peerText() const noexcept {
    return peer.empty() ? address : peer;
  }
};

struct RouterView {
  std::string file;  // name of the segment
  std::uint64_t incarnation = 0;
  std::string name;  // of the router, from its configuration
  std::string program;
  Owner owner;
  Life life{};
  char processState = '?';
  std::int64_t ageNs = 0;
  std::uint64_t bytes = 0;
  std::vector<RouterLineView> lines;  // clients first, then by row

  // The connection over which local clients reach that location; null without such a connection.
  [[nodiscard]] const RouterLineView* lineTo(std::int32_t location) const;
  // The connection whose remote clients have a local window with this label; null when no
  // connection fits, or several do.
  [[nodiscard]] const RouterLineView* lineFrom(const std::string& label) const;
};

// nullopt when no segment of that name exists (any more).
//   throws  as SegmentImage::tryRead
[[nodiscard]] std::optional<RouterView> tryReadRouter(const std::string& name);
// The rows in use of a router's segment, of which `image` is a copy. Reads the file at `path` again
// until the texts of each row are consistent.
[[nodiscard]] std::vector<RouterLineView> routerLines(const SegmentImage& image,
                                                      const std::string& path);

}  // namespace mpf::tools
