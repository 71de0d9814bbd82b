// SPDX-License-Identifier: MIT
#include "shm/hot_links.h"

namespace mpf {

bool HotLinks::tryAdd(std::uint32_t index, Link& link) noexcept {
  for (std::size_t place = 0; place < size_; ++place) {
    if (hot_[place].index == index) return true;
  }
  for (std::size_t place = 0; place < size_ && size_ == kCapacity; ++place) {
    if (hot_[place].misses >= kReplaceAfter) cool(place);
  }
  if (size_ == kCapacity) return false;
  hot_[size_++] = {index, 0, &link};
  link.setWatched(true);
  return true;
}

void HotLinks::remove(std::uint32_t index) noexcept {
  for (std::size_t place = 0; place < size_; ++place) {
    if (hot_[place].index != index) continue;
    cool(place);
    return;
  }
}

void HotLinks::removeAll() noexcept {
  while (size_ != 0) cool(size_ - 1);
}

std::optional<std::uint32_t> HotLinks::cool(std::size_t place) noexcept {
  const auto cooled = hot_[place];
  hot_[place] = hot_[--size_];
  cooled.link->setWatched(false);
  if (cooled.link->hasEvents()) readyBits_.set(cooled.index);
  return cooled.link->incoming().hasMessage() ? std::optional(cooled.index) : std::nullopt;
}

}  // namespace mpf
