// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/sniff_queue.h"

#include <algorithm>
#include <utility>

namespace mpf {

SniffQueue::SniffQueue(const SniffBatching& batching) : batching_(batching) {
  bytes_.reserve(batching_.maxBytes);
}

bool SniffQueue::push(std::span<const PeekedByte> bytes) {
  const std::lock_guard lock(mutex_);
  const auto before = bytes_.size();
  const auto fitting = bytes.first(std::min(bytes.size(), batching_.maxBytes - before));
  bytes_.insert(bytes_.end(), fitting.begin(), fitting.end());
  lost_ += bytes.size() - fitting.size();
  if (before == 0) firstIsOld_ = Deadline::after(batching_.maxAge);
  return before == 0 || (before < batching_.largeBytes && bytes_.size() >= batching_.largeBytes);
}

Deadline SniffQueue::dueAt() const {
  const std::lock_guard lock(mutex_);
  if (bytes_.empty()) return Deadline::never();
  return bytes_.size() >= batching_.largeBytes ? Deadline::atNs(0) : firstIsOld_;
}

std::uint64_t SniffQueue::take(std::vector<PeekedByte>& bytes) {
  bytes.clear();
  bytes.reserve(batching_.maxBytes);
  const std::lock_guard lock(mutex_);
  bytes_.swap(bytes);
  return std::exchange(lost_, 0);
}

}  // namespace mpf
