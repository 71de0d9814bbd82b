// SPDX-License-Identifier: MIT
#include "server/programs/sniff/sniff_queue.h"

#include <algorithm>
#include <utility>

namespace mpf {

SniffQueue::SniffQueue(const SniffBatching& batching) : batching_(batching) {
  records_.reserve(batching_.maxBytes);
}

bool SniffQueue::push(std::span<const SniffBytes> records) {
  const std::lock_guard lock(mutex_);
  const auto before = records_.size();
  const auto fitting = records.first(std::min(records.size(), batching_.maxBytes - before));
  records_.insert(records_.end(), fitting.begin(), fitting.end());
  lost_ += records.size() - fitting.size();
  if (before == 0) firstIsOld_ = Deadline::after(batching_.maxAge);
  return before == 0 || (before < batching_.largeBytes && records_.size() >= batching_.largeBytes);
}

Deadline SniffQueue::dueAt() const {
  const std::lock_guard lock(mutex_);
  if (records_.empty()) return Deadline::never();
  return records_.size() >= batching_.largeBytes ? Deadline::atNs(0) : firstIsOld_;
}

std::uint64_t SniffQueue::take(std::vector<SniffBytes>& records) {
  records.clear();
  records.reserve(batching_.maxBytes);
  const std::lock_guard lock(mutex_);
  records_.swap(records);
  return std::exchange(lost_, 0);
}

}  // namespace mpf
