// SPDX-License-Identifier: MIT
#include "shm/hot_links.h"

#include <algorithm>

namespace mpf {

bool HotLinks::tryAdd(std::uint32_t index, Link& link) noexcept {
  for (std::size_t place = 0; place < size_; ++place) {
    if (hot_[place].index != index) continue;
    hot_[place].misses = 0;  // its owner takes a message now
    return true;
  }
  for (std::size_t place = 0; place < size_ && size_ == kCapacity; ++place) {
    if (hot_[place].misses >= kReplaceAfter) cool(place);
  }
  if (size_ == kCapacity) return false;
  hot_[size_++] = {index, 0, 0, &link};
  link.watch(pollsInWaits_);
  return true;
}

void HotLinks::remove(std::uint32_t index) noexcept {
  for (std::size_t place = 0; place < size_; ++place) {
    if (hot_[place].index != index) continue;
    cool(place);
    return;
  }
}

// One barrier for all links.
void HotLinks::removeAll() noexcept {
  if (size_ == 0) return;
  auto barrier = Link::Barrier::fence;
  for (std::size_t place = 0; place < size_; ++place)
    barrier = std::max(barrier, hot_[place].link->unwatch());
  Link::execute(barrier);
  for (; size_ != 0; --size_) noteEvents(hot_[size_ - 1]);
}

void HotLinks::noteEvents(const Hot& cooled) noexcept {
  if (cooled.link->hasEvents()) readyBits_.set(cooled.index);
  else cooled.link->incoming().onEmpty();
}

Link* HotLinks::cool(std::size_t place) noexcept {
  const auto cooled = hot_[place];
  hot_[place] = hot_[--size_];
  Link::execute(cooled.link->unwatch());
  noteEvents(cooled);
  return cooled.link->incoming().hasMessage() ? cooled.link : nullptr;
}

}  // namespace mpf
