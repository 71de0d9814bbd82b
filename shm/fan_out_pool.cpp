// SPDX-License-Identifier: MIT
#include "shm/fan_out_pool.h"

#include <algorithm>
#include <new>
#include <utility>

#include "base/step.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

constexpr std::size_t kMaxChunks = 256;
constexpr std::size_t kMaxBodyBytes = UINT32_MAX;  // the largest value of Slot::bodyBytes

// Whole pages: a client drops the copies that it made of the pages of one chunk.
std::size_t segmentBytes(std::size_t bytes) noexcept {
  const auto pages = (bytes + layout::kPageBytes - 1) / layout::kPageBytes;
  return layout::kBulkChunksOffset + std::max<std::size_t>(pages, 1) * layout::kPageBytes;
}

// Whether a chunk of this capacity does not waste too much memory.
bool fits(std::size_t capacity, std::size_t bytes) noexcept {
  return capacity >= bytes && capacity <= 2 * bytes + 16 * layout::kPageBytes;
}

}  // namespace

bool FanOutChunk::tryClaim() noexcept {
  std::uint32_t none = 0;
  // PAIR(fan-out-dropped): all former holders have finished with the chunk; sees whether one of
  // them has retired it.
  if (!holders_.compare_exchange_strong(none, 1, std::memory_order_acquire,
                                        std::memory_order_relaxed))
    return false;
  if (!isRetired_.load(std::memory_order_relaxed)) return true;
  drop();
  return false;
}

FanOutPool::FanOutPool(std::string backplane, std::uint64_t serverWindow, const Rights& clients,
                       std::uint64_t maxBytes)
    : backplane_(std::move(backplane)),
      serverWindow_(serverWindow),
      rights_{.mode = 0400 | (clients.mode & 0444), .group = clients.group},
      maxBytes_(maxBytes) {}

FanOutPool::~FanOutPool() {
  if (forkGuard_.isInherited()) return;
  for (const auto& chunk : chunks_) segments::remove(chunk->segment().name());
}

std::uint64_t FanOutPool::bytes() const noexcept {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

std::shared_ptr<FanOutChunk> FanOutPool::tryAlloc(std::size_t bytes) noexcept try {
  if (bytes > kMaxBodyBytes) return nullptr;
  removeRetired();
  const auto needed = segmentBytes(bytes);
  std::uint32_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    if (auto chunk = tryReuse(bytes)) return chunk;
    if (!tryMakeRoom(needed)) return nullptr;
    if (created_ == layout::kReturnsFanOut) return nullptr;  // no number is used twice
    bytes_ += needed;
    number = created_++;
  }
  return tryCreate(needed, number);
} catch (const std::bad_alloc&) {
  return nullptr;
}

// Creates a chunk whose bytes have been counted. Without the lock, because it takes milliseconds to
// reserve a large segment.
std::shared_ptr<FanOutChunk> FanOutPool::tryCreate(std::size_t bytes,
                                                   std::uint32_t number) noexcept {
  std::shared_ptr<FanOutChunk> chunk;
  try {
    chunk = create(bytes, number);
    const std::lock_guard lock(mutex_);
    chunks_.push_back(chunk);
    return chunk;
  } catch (const std::exception&) {  // /dev/shm is full: the caller refuses the message
    if (chunk) segments::remove(chunk->segment().name());
    const std::lock_guard lock(mutex_);
    bytes_ -= bytes;
    return nullptr;
  }
}

std::shared_ptr<FanOutChunk> FanOutPool::tryReuse(std::size_t bytes) noexcept {
  for (const auto& chunk : chunks_) {
    if (fits(chunk->capacity(), bytes) && chunk->tryClaim()) return chunk;
  }
  return nullptr;
}

// Removes free chunks, which have another size, until there is room for `bytes`.
bool FanOutPool::tryMakeRoom(std::size_t bytes) noexcept {
  const auto hasRoom = [&] {
    return bytes_ <= maxBytes_ && bytes <= maxBytes_ - bytes_ && chunks_.size() < kMaxChunks;
  };
  for (auto index = chunks_.size(); index-- > 0 && !hasRoom();) {
    if (chunks_[index]->tryClaim()) remove(index);
  }
  return hasRoom();
}

std::shared_ptr<FanOutChunk> FanOutPool::create(std::size_t bytes, std::uint32_t number) const {
  auto segment = Segment::create(bytes, layout::SegmentKind::fanOut, backplane_, rights_);
  auto& header = segment.sharedHeader();
  header.ownerWindow = serverWindow_;
  header.serverWindow = serverWindow_;
  header.chunkBytes = bytes - layout::kBulkChunksOffset;
  header.chunkCount = 1;
  const auto name = SegmentName::fanOut(backplane_, serverWindow_, number);
  auto chunk = std::make_shared<FanOutChunk>(std::move(segment), number);
  // Last, because nothing may fail after the file has its name.
  if (!chunk->segment_.tryPublish(name))
    throw SegmentError(segments::path(name) + ": a file of this name exists already");
  MPF_STEP(fan_out_named);
  chunk->segment_.closeFile();
  return chunk;
}

void FanOutPool::remove(std::size_t index) noexcept {
  const auto& segment = chunks_[index]->segment();
  segments::remove(segment.name());
  bytes_ -= segment.bytes();
  chunks_.erase(chunks_.begin() + static_cast<std::ptrdiff_t>(index));
}

void FanOutPool::removeRetired() noexcept {
  const std::lock_guard lock(mutex_);
  for (auto index = chunks_.size(); index-- > 0;) {
    if (chunks_[index]->isAbandoned()) remove(index);
  }
}

std::shared_ptr<FanOutChunk> FanOutPool::tryFind(const std::byte* data) const noexcept {
  const std::lock_guard lock(mutex_);
  for (const auto& chunk : chunks_) {
    if (data >= chunk->data() && data < chunk->data() + chunk->capacity()) return chunk;
  }
  return nullptr;
}

}  // namespace mpf
