// SPDX-License-Identifier: MIT
#include "shm/pool.h"

#include <algorithm>
#include <bit>
#include <ranges>
#include <utility>

#include "base/step.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

constexpr std::size_t kMaxChunkBytes = UINT32_MAX;  // the largest value of Slot::bodyBytes

// A power of two for the elements, plus room for the header of a message: 1 MiB of data then does
// not need a chunk of 2 MiB.
std::size_t chunkBytesFor(std::size_t bytes) noexcept {
  constexpr std::size_t kHeaderRoom = 128;
  const auto power = std::bit_ceil(std::max<std::size_t>(bytes, 512 + kHeaderRoom) - kHeaderRoom);
  return power + kHeaderRoom;
}

std::uint32_t chunkCountFor(std::size_t chunkBytes) {
  constexpr std::size_t kBulkBytes = std::size_t{256} * 1024;
  constexpr std::size_t kHugeBytes = std::size_t{16} * 1024 * 1024;
  if (chunkBytes > kHugeBytes) return 1;
  return static_cast<std::uint32_t>(std::clamp<std::size_t>(kBulkBytes / chunkBytes, 2, 32));
}

}  // namespace

PoolOwner::PoolOwner(PoolPlace place, Rights rights, std::uint64_t maxBytes,
                     layout::ReturnRing& returns)
    : place_(place), rights_(rights), maxBytes_(maxBytes), returns_(&returns) {}

PoolOwner::~PoolOwner() {
  if (forkGuard_.isInherited() || leavesNames_) return;
  for (const auto& bulk : std::views::reverse(bulks_)) segments::remove(bulk.segment.name());
}

std::optional<Chunk> PoolOwner::tryAlloc(std::size_t bytes) noexcept {
  collectReturned();
  if (!canLend() || bytes > kMaxChunkBytes) return std::nullopt;
  const auto chunkBytes = chunkBytesFor(bytes);
  for (int attempt = 0; attempt < 2; ++attempt) {
    for (auto& bulk : bulks_) {
      if (bulk.chunkSize.bytes() != chunkBytes || bulk.free.empty()) continue;
      const auto index = bulk.free.back();
      bulk.free.pop_back();
      bulk.states[index] = ChunkState::held;
      ++inUse_;
      MPF_STEP(chunk_claimed);
      return Chunk{bulk.chunk(index), chunkBytes};
    }
    if (!tryGrow(chunkBytes)) break;
  }
  return std::nullopt;
}

bool PoolOwner::isWithinLimit(std::size_t bytes) const noexcept {
  return bytes <= kMaxChunkBytes && layout::kBulkChunksOffset + chunkBytesFor(bytes) <= maxBytes_;
}

void PoolOwner::Bulk::freeAll() noexcept {
  for (auto index = static_cast<std::uint32_t>(states.size()); index-- > 0;) free.push_back(index);
}

// Not a member of its own: the path of a message multiplies by the size of a Bulk.
bool PoolOwner::Bulk::isReleased() const noexcept {
  return free.empty() &&
         std::ranges::all_of(states, [](ChunkState state) { return state == ChunkState::free; });
}

bool PoolOwner::tryGrow(std::size_t chunkBytes) noexcept {
  const auto least = layout::kBulkChunksOffset + chunkBytes;
  const auto tryAdd = [&] { return tryReserveReleased(chunkBytes) || addBulk(chunkBytes); };
  if (!tryMakeRoom(least)) return false;
  if (tryAdd()) return true;
  // /dev/shm may be full.
  bool hasReleased = false;
  for (auto& bulk : bulks_) hasReleased |= tryRelease(bulk);
  return hasReleased && tryAdd();
}

// Releases segments without a chunk in use until there is room for `bytes`; none if all of them
// would not be enough, because a sender that has to wait may try this often.
bool PoolOwner::tryMakeRoom(std::uint64_t bytes) noexcept {
  auto possible = room();
  for (const auto& bulk : bulks_) possible += bulk.isIdle() ? bulk.segment.bytes() : 0;
  if (possible < bytes) return false;
  for (auto& bulk : std::views::reverse(bulks_)) {
    if (room() >= bytes) break;
    tryRelease(bulk);
  }
  return room() >= bytes;
}

bool PoolOwner::tryRelease(Bulk& bulk) noexcept {
  if (!bulk.isIdle() || !bulk.segment.tryRelease(layout::kBulkChunksOffset)) return false;
  bulk.free.clear();
  bytes_ -= bulk.segment.bytes();
  return true;
}

bool PoolOwner::tryReserveReleased(std::size_t chunkBytes) noexcept {
  for (auto& bulk : bulks_) {
    if (!bulk.isReleased() || bulk.chunkSize.bytes() != chunkBytes) continue;
    if (bulk.segment.bytes() > room() || !bulk.segment.tryReserve()) continue;
    bulk.freeAll();
    bytes_ += bulk.segment.bytes();
    return true;
  }
  return false;
}

bool PoolOwner::addBulk(std::size_t chunkBytes) noexcept try {
  if (bulks_.size() >= layout::kMaxBulks) return false;
  // A segment may be smaller than usual if there is room for some chunks only.
  const auto fitting = (room() - layout::kBulkChunksOffset) / chunkBytes;
  const auto count =
      static_cast<std::uint32_t>(std::min<std::uint64_t>(chunkCountFor(chunkBytes), fitting));
  const auto bytes = layout::kBulkChunksOffset + count * chunkBytes;
  auto segment = Segment::create(bytes, layout::SegmentKind::bulk, place_.backplane, rights_);
  auto& header = segment.sharedHeader();
  header.ownerWindow = place_.ownerWindow;
  header.chunkBytes = chunkBytes;
  header.chunkCount = count;
  header.bulkSide = place_.side;
  const auto name = SegmentName::bulk(place_.backplane, place_.link, place_.side,
                                      static_cast<std::uint32_t>(bulks_.size()));
  Bulk bulk{std::move(segment),
            ChunkSize(chunkBytes),
            std::vector<ChunkState>(count, ChunkState::free),
            {}};
  bulk.free.reserve(count);
  bulk.freeAll();
  bulks_.reserve(bulks_.size() + 1);
  // Last, because nothing may fail after the file has its name: no other segment could have it.
  if (!bulk.segment.tryPublish(name)) return false;
  MPF_STEP(bulk_named);
  bulk.segment.closeFile();
  bytes_ += bytes;
  bulks_.push_back(std::move(bulk));
  return true;
} catch (const std::exception&) {
  return false;  // /dev/shm is full: the caller refuses the message
}

void PoolOwner::collectReturned() noexcept {
  // PAIR(chunk-returned): the borrower has finished with the chunk.
  const auto returned = returns_->returned.load(std::memory_order_acquire);
  // A larger value is invalid: the borrower never has more chunks than this.
  const auto end = std::min(returned, collected_ + layout::kReturnSlots);
  for (; collected_ < end; ++collected_) {
    const auto packed =
        returns_->chunks[collected_ % layout::kReturnSlots].load(std::memory_order_relaxed);
    if ((packed & layout::kReturnsFanOut) != 0) {
      loans_.takeBack(packed & ~layout::kReturnsFanOut);
      continue;
    }
    const ChunkPlace place{packed / layout::kMaxChunks, packed % layout::kMaxChunks};
    if (tryReceiveBack(place)) free(place);
  }
}

bool PoolBorrower::tryMap(std::uint32_t number) try {
  // The peer has released segments of other sizes: they count for its limit no longer, but stay
  // mapped.
  constexpr std::uint64_t kMaxSizes = 32;
  if (number >= layout::kMaxBulks || bytes_ / kMaxSizes >= maxBytes_) return false;
  auto segment =
      Segment::tryOpen(SegmentName::bulk(place_.backplane, place_.link, place_.side, number),
                       layout::SegmentKind::bulk, Segment::Access::readWrite);
  if (!segment || segment->bytes() > maxBytes_) return false;
  const auto header = segment->header();
  const auto room =
      segment->bytes() - std::min<std::size_t>(segment->bytes(), layout::kBulkChunksOffset);
  if (header.chunkBytes == 0 || header.chunkBytes % layout::kCacheLineBytes != 0) return false;
  if (header.chunkCount > room / header.chunkBytes || header.chunkCount > layout::kMaxChunks)
    return false;
  if (number >= bulks_.size()) bulks_.resize(number + 1);
  segment->closeFile();
  bytes_ += segment->bytes();
  bulks_[number] = {std::move(*segment), ChunkSize(header.chunkBytes), header.chunkCount};
  return true;
} catch (const SegmentError&) {
  return false;
}

std::optional<Chunk> PoolBorrower::tryBorrow(ChunkPlace place) {
  return isMapped(place.segment) || tryMap(place.segment) ? tryBorrowMapped(place) : std::nullopt;
}

void PoolBorrower::returnPacked(std::uint32_t packed) noexcept {
  returns_->chunks[returned_ % layout::kReturnSlots].store(packed, std::memory_order_relaxed);
  MPF_STEP(chunk_noted);
  // PAIR(chunk-returned): we have finished with the chunk.
  returns_->returned.store(++returned_, std::memory_order_release);
  MPF_STEP(chunk_returned);
}

void removeBulk(std::string_view backplane, std::uint64_t link) noexcept {
  for (std::uint32_t side = 0; side < 2; ++side) {
    const auto name = [&](std::uint32_t number) {
      return SegmentName::bulkText(backplane, link, side, number);
    };
    std::uint32_t count = 0;
    while (segments::exists(name(count).data())) ++count;
    while (count != 0) segments::remove(name(--count).data());
  }
}

}  // namespace mpf
