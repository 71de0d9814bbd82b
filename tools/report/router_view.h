// SPDX-License-Identifier: MIT
// RouterView: what a router says of its connections, copied from its segment. Part of snapshot.h.
//
//   mpf.<backplane>.r.<incarnation> ─ pread, and each row again until two copies have the same texts ─► RouterView
//
// Threads  one.
// Crash    a router that died or was stopped while it changed a text leaves that text half changed:
//          it is shown as it is.
// Trust    texts come from anywhere, a peer's name from another host: no control character is left
//          in them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/inspect/segment_image.h"

namespace mpf::tools {

enum class Life { alive, closed, dead };

// Whose a segment is. A pid alone may be somebody else's by now.
struct Owner {
  std::int32_t pid = 0;
  std::uint64_t startTicks = 0;
  std::uint64_t pidNamespace = 0;
  static Owner of(const layout::SegmentHeader& header) noexcept {
    return {header.ownerPid, header.ownerStartTicks, header.pidNamespace};
  }
  auto operator<=>(const Owner&) const = default;
};
// The letter of field 3 of /proc/<pid>/stat; '?' when it cannot be told.
[[nodiscard]] char processState(const Owner& owner);

// "waiting" (to try again), "connecting", "connected".
[[nodiscard]] const char* toString(layout::RouterLineState state) noexcept;

// One connection, or one remote that is to be connected to.
struct RouterLineView {
  std::size_t row = 0;
  layout::RouterRole role{};
  layout::RouterLineState state{};
  bool isTls = false;
  std::int64_t sinceNs = 0;  // CLOCK_MONOTONIC: since when it is connected, or is not
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
  // Whom it leads to: the peer's name, or its address while that is not known.
  [[nodiscard]] const std::string& peerText() const noexcept {
    return peer.empty() ? address : peer;
  }
};

struct RouterView {
  std::string file;  // name of the segment
  std::uint64_t incarnation = 0;
  std::string name;  // what it calls itself
  std::string program;
  Owner owner;
  Life life{};
  char processState = '?';
  std::int64_t ageNs = 0;
  std::uint64_t bytes = 0;
  std::vector<RouterLineView> lines;  // clients first, then by row

  // The connection by which clients here reach that location; null when there is none.
  [[nodiscard]] const RouterLineView* lineTo(std::int32_t location) const;
  // The connection whose far clients have a window of this label here; null when that is not
  // certain.
  [[nodiscard]] const RouterLineView* lineFrom(const std::string& label) const;
};

// nullopt when there is no segment of that name (any more).
//   throws  as SegmentImage::tryRead
[[nodiscard]] std::optional<RouterView> tryReadRouter(const std::string& name);
// The rows in use of a router's segment, of which `image` is a copy; the file is read again, for
// the texts.
[[nodiscard]] std::vector<RouterLineView> routerLines(const SegmentImage& image,
                                                      const std::string& path);

}  // namespace mpf::tools
