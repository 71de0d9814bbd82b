// SPDX-License-Identifier: MIT
#include "router/transport/keep_alive.h"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <utility>

namespace mpf::router {
namespace {

// This many bytes of a frame that is still arriving are a sign of life.
constexpr std::size_t kProgressBytes = std::size_t{64} << 10;
constexpr std::int64_t kMeasureEveryNs = 10'000'000'000;
constexpr std::int64_t kLeastCheckNs = 1'000'000;

}  // namespace

KeepAlive::KeepAlive(const Limits& limits)
    : deadNs_(std::chrono::nanoseconds(limits.deadTime).count()),
      handshakeNs_(std::chrono::nanoseconds(limits.handshakeTime).count()),
      checkAfterNs_(deadNs_ / 2) {}

void KeepAlive::start(std::int64_t nowNs) {
  lastReceiveNs_ = nowNs;
  greetingDueNs_ = nowNs + handshakeNs_;
}

std::int64_t KeepAlive::beginCheck(std::int64_t nowNs) {
  const auto dueNs = std::min(lastReceiveNs_ + deadNs_, greetingDueNs_.value_or(INT64_MAX));
  const auto afterNs =
      std::clamp(dueNs - nowNs, kLeastCheckNs, std::exchange(checkAfterNs_, deadNs_ / 2));
  checkDueNs_ = nowNs + afterNs;
  return afterNs;
}

std::string KeepAlive::check(std::int64_t nowNs) {
  // Time during which this process did not run does not count against the peer.
  const auto lateNs = std::max<std::int64_t>(nowNs - checkDueNs_, 0);
  lastReceiveNs_ = std::min(lastReceiveNs_ + lateNs, nowNs);
  if (greetingDueNs_) *greetingDueNs_ += lateNs;
  if (partialBytes_ >= kProgressBytes) frameReceived(nowNs);
  auto missed = missedDeadline(nowNs);
  const bool wasOverdue = std::exchange(overdue_, !missed.empty());
  return wasOverdue ? missed : std::string();
}

std::string KeepAlive::missedDeadline(std::int64_t nowNs) const {
  if (nowNs - lastReceiveNs_ >= deadNs_) {
    return fmt::format("received nothing from the peer for {} ms (dead-time)",
                       (nowNs - lastReceiveNs_) / 1'000'000);
  }
  if (!greetingDueNs_ || nowNs < *greetingDueNs_) return {};
  return fmt::format("the peer sent no greeting within {} ms (handshake-time)",
                     handshakeNs_ / 1'000'000);
}

bool KeepAlive::shouldMeasure(std::int64_t nowNs) const noexcept {
  return nowNs - lastPingNs_ >= kMeasureEveryNs;
}

bool KeepAlive::tryPostpone(std::int64_t nowNs) {
  const auto quarter = deadNs_ / 8;  // of the usual time between two checks
  if (nowNs - lastPostponeNs_ < quarter) return false;
  lastPostponeNs_ = nowNs;
  checkAfterNs_ = deadNs_ / 2 + quarter +
                  static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(quarter + 1));
  return true;
}

}  // namespace mpf::router
