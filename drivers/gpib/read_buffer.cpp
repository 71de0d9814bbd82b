// SPDX-License-Identifier: MIT
#include "drivers/gpib/read_buffer.h"

#include <algorithm>
#include <utility>

namespace mpf {

void ReadBuffer::append(std::span<const std::uint8_t> bytes, bool end) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  end_ = end && !bytes_.empty();
}

std::optional<GpibReadResult> ReadBuffer::take(const GpibReadLimits& limits) {
  auto length = std::min(limits.maxBytes, bytes_.size());
  bool isComplete = length == limits.maxBytes || end_;
  if (limits.endOfString) {
    const auto stop = bytes_.begin() + static_cast<std::ptrdiff_t>(length);
    const auto found = std::find(bytes_.begin(), stop, *limits.endOfString);
    if (found != stop) {
      length = static_cast<std::size_t>(found - bytes_.begin()) + 1;
      isComplete = true;
    }
  }
  if (!isComplete) return std::nullopt;
  GpibReadResult result;
  const auto stop = bytes_.begin() + static_cast<std::ptrdiff_t>(length);
  result.data.assign(bytes_.begin(), stop);
  bytes_.erase(bytes_.begin(), stop);
  if (bytes_.empty()) result.sawEnd = std::exchange(end_, false);
  return result;
}

std::vector<std::uint8_t> ReadBuffer::takeAll() {
  end_ = false;
  return std::exchange(bytes_, {});
}

}  // namespace mpf
