// SPDX-License-Identifier: MIT
#include "shm/fan_out_borrower.h"

#include <algorithm>
#include <utility>

#include "base/step.h"
#include "shm/segment_name.h"

namespace mpf {

std::optional<Chunk> FanOutBorrower::tryBorrow(ChunkPlace place, std::uint32_t missed) try {
  const auto number = place.segment;
  if (number >= layout::kReturnsFanOut || place.chunk != 0) return std::nullopt;
  const auto free = std::ranges::find_if(
      views_, [&](const View& view) { return view.number == number && !view.isHeld; });
  auto* const view = free != views_.end() ? &*free : tryMap(number);
  if (view == nullptr || view->segment.isLost()) return std::nullopt;
  view->isHeld = true;
  return Chunk{view->segment.data() + layout::kBulkChunksOffset,
               view->segment.bytes() - layout::kBulkChunksOffset, true, missed};
} catch (const SegmentError&) {
  return std::nullopt;
}

FanOutBorrower::View* FanOutBorrower::tryMap(std::uint32_t number) {
  unmapUnused();
  if (views_.size() == kMaxMappings) return nullptr;
  auto segment = Segment::tryOpen(SegmentName::fanOut(backplane_, serverWindow_, number),
                                  layout::SegmentKind::fanOut, Segment::Access::copyOnWrite);
  if (!segment || segment->bytes() <= layout::kBulkChunksOffset ||
      segment->header().chunkBytes > segment->bytes() - layout::kBulkChunksOffset)
    return nullptr;
  segment->closeFile();
  views_.push_back({std::move(*segment), number, false});
  MPF_STEP(fan_out_mapped);
  return &views_.back();
}

// Unmaps the segments that the server has removed. If there are too many others, unmaps those, too.
void FanOutBorrower::unmapUnused() noexcept {
  std::erase_if(views_, [](const View& view) {
    return !view.isHeld && !segments::exists(view.segment.name());
  });
  if (views_.size() == kMaxMappings)
    std::erase_if(views_, [](const View& view) { return !view.isHeld; });
}

std::optional<std::uint32_t> FanOutBorrower::tryRelease(const std::byte* data) noexcept {
  const auto held = std::ranges::find_if(views_, [data](const View& view) {
    return view.isHeld && data == view.segment.data() + layout::kBulkChunksOffset;
  });
  if (held == views_.end()) return std::nullopt;
  held->isHeld = false;
  return held->number;
}

}  // namespace mpf
