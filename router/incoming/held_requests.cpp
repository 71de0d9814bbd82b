// SPDX-License-Identifier: MIT
#include "router/incoming/held_requests.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace mpf::router {

bool HeldRequests::tryHold(HeldRequest&& request) {
  const auto bytes = request.bytes();
  const bool exceedsLimit = requests_.size() >= maxRequests_ || bytes_ + bytes > kMaxBytes ||
                            totalBytes_ + bytes > kMaxTotalBytes;
  if (exceedsLimit && totalBytes_ != 0) return false;
  bytes_ += bytes;
  totalBytes_ += bytes;
  requests_.push_back(std::move(request));
  return true;
}

void HeldRequests::release(std::size_t bytes) noexcept {
  bytes_ -= bytes;
  totalBytes_ -= bytes;
}

std::vector<HeldRequest> HeldRequests::takeExpired() {
  const auto expired = std::ranges::stable_partition(
      requests_, [](const HeldRequest& request) { return !request.takeBefore.hasPassed(); });
  std::vector<HeldRequest> taken(std::move_iterator(expired.begin()),
                                 std::move_iterator(expired.end()));
  requests_.erase(expired.begin(), expired.end());
  for (const auto& request : taken) release(request.bytes());
  return taken;
}

std::vector<HeldRequest> HeldRequests::takeAll() {
  release(bytes_);
  return std::exchange(requests_, {});
}

Deadline HeldRequests::nextDeadline() const noexcept {
  auto next = Deadline::never();
  for (const auto& request : requests_) next = std::min(next, request.takeBefore);
  return next;
}

}  // namespace mpf::router
