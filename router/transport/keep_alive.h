// SPDX-License-Identifier: MIT
// KeepAlive: decides when a peer has been silent for too long, and when this side sends pings.
//
//   beginCheck() ─ half of dead-time ─► check() ─ in time ──────► ping, next check
//                                               ├ overdue ──────► ping, next check
//                                               └ overdue again ► the reason to end the connection
//
// On an idle connection only one side sends pings, which halves the number of frames: a ping of the
// peer is a sign of life, so this side postpones its own. The delay is random, because otherwise
// both sides might send their pings at the same time again and again.
//
// Threads  one. It reads no clock: all times are passed in [ns].
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <string>

#include "router/config/router_config.h"

namespace mpf::router {

class KeepAlive {
 public:
  explicit KeepAlive(const Limits& limits);

  // The connection has started: the peer has Limits::handshakeTime for its greeting.
  void start(std::int64_t nowNs);
  void greetingReceived() noexcept { greetingDueNs_.reset(); }
  // A sign of life of the peer.
  void received(std::int64_t nowNs) noexcept { lastReceiveNs_ = nowNs; }
  // Bytes of a frame that is not yet complete. Many of them are a sign of life at the next check.
  void bytesReceived(std::size_t bytes) noexcept { partialBytes_ += bytes; }
  void frameReceived(std::int64_t nowNs) noexcept {
    lastReceiveNs_ = nowNs;
    partialBytes_ = 0;
  }

  // Returns the time until the next check(): at most the time that tryPostpone() has set, and no
  // later than the peer's deadline.
  [[nodiscard]] std::int64_t beginCheck(std::int64_t nowNs);
  // Which deadline the peer has missed; an empty text: the connection continues. Only the second
  // check in a row counts: when this process did not run for a while, data of the peer may not have
  // been read yet.
  [[nodiscard]] std::string check(std::int64_t nowNs);

  void pingSent(std::int64_t nowNs) noexcept { lastPingNs_ = nowNs; }
  // The pings of the peer make those of this side unnecessary. True when one is due all the same,
  // to measure the round trip.
  [[nodiscard]] bool shouldMeasure(std::int64_t nowNs) const noexcept;
  // The peer has sent a ping. Returns true when the next check is later now: call beginCheck().
  [[nodiscard]] bool tryPostpone(std::int64_t nowNs);

 private:
  [[nodiscard]] std::string missedDeadline(std::int64_t nowNs) const;

  std::int64_t deadNs_;
  std::int64_t handshakeNs_;
  std::int64_t lastReceiveNs_ = 0;  // time of the last sign of life
  std::optional<std::int64_t> greetingDueNs_;  // nullopt: the greeting has arrived
  std::size_t partialBytes_ = 0;  // received since lastReceiveNs_, of a frame that is arriving
  bool overdue_ = false;  // the last check has found the peer overdue
  std::int64_t checkAfterNs_;  // longest time until the next check
  std::int64_t checkDueNs_ = 0;
  std::int64_t lastPingNs_ = 0;
  std::int64_t lastPostponeNs_ = 0;
  std::minstd_rand random_{std::random_device{}()};
};

}  // namespace mpf::router
