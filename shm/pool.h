// SPDX-License-Identifier: MIT
// Pool: memory for messages that do not fit a ring. Each side of a link owns one pool and borrows
// from the other's.
//
//   owner  alloc ─► build in place ─► ChunkRef through the ring ─► borrower reads in place ─► give back (ReturnRing)
//                                                              └► or sends it back in a reply
//
// Bulk segments hold chunks of one size, a power of two and a bit for headers; they are created
// when first needed, so a link that sends small messages costs nothing here.
//
// Threads  callers serialise; Link does.
// Crash    bulk segments belong to their link and go with it.
// Trust    a ChunkRef from a peer is checked against what was mapped or lent; nonsense is refused.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shm/fork_guard.h"
#include "shm/layout.h"
#include "shm/segment.h"

namespace mpf {

struct Chunk {
  std::byte* data{};
  std::size_t capacity{};
  layout::ChunkRef ref{};
};

// Names a link's pool on either side.
struct PoolPlace {
  std::string backplane;
  std::uint64_t link{};
  std::uint32_t side{};
  std::uint64_t ownerWindow{};
};

class PoolOwner {
 public:
  PoolOwner(PoolPlace place, Rights rights, std::uint64_t maxBytes, layout::ReturnRing& returns);
  ~PoolOwner();
  PoolOwner(PoolOwner&&) = default;

  // nullopt when the limit of the link or /dev/shm is exhausted, or the peer holds too many chunks.
  std::optional<Chunk> tryAlloc(std::size_t bytes) noexcept;
  // The chunk is the peer's now, until it returns.
  void lend(const layout::ChunkRef& ref) noexcept;
  // The peer sent the chunk back in a message: nullopt when we had not lent it.
  std::optional<Chunk> tryReceiveBack(const layout::ChunkRef& ref) noexcept;
  // Frees a chunk that we hold.
  void free(const layout::ChunkRef& ref) noexcept;
  // Where a pointer into this pool belongs to; nullopt when it is not ours.
  std::optional<layout::ChunkRef> tryFind(const std::byte* data) const noexcept;
  [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_; }
  // Its segments keep their names, which somebody else will remove.
  void leaveNames() noexcept { leavesNames_ = true; }

 private:
  enum class ChunkState : std::uint8_t { free, held, lent };
  struct Bulk {
    Segment segment;
    std::size_t chunkBytes{};
    std::vector<ChunkState> states;
    std::vector<std::uint32_t> free;
    [[nodiscard]] std::byte* chunk(std::uint32_t index) const {
      return segment.data() + layout::kBulkChunksOffset + index * chunkBytes;
    }
  };
  void collectReturned() noexcept;
  bool addBulk(std::size_t chunkBytes);
  bool isState(const layout::ChunkRef& ref, ChunkState state) const noexcept;

  ForkGuard forkGuard_;
  PoolPlace place_;
  Rights rights_;
  std::uint64_t maxBytes_;
  std::uint64_t bytes_ = 0;
  layout::ReturnRing* returns_;
  std::uint64_t collected_ = 0;
  bool leavesNames_ = false;
  std::uint32_t inUse_ = 0;  // chunks held or lent, at most kReturnSlots
  std::vector<Bulk> bulks_;
};

class PoolBorrower {
 public:
  PoolBorrower(PoolPlace place, std::uint64_t maxBytes, layout::ReturnRing& returns)
      : place_(std::move(place)), maxBytes_(maxBytes), returns_(&returns) {}

  // The memory of a chunk that the peer sent; nullopt when there is no such chunk.
  //   throws  std::system_error, std::bad_alloc: it cannot be looked at, for lack of descriptors or
  //           memory
  std::optional<Chunk> tryBorrow(const layout::ChunkRef& ref);
  void giveBack(const layout::ChunkRef& ref) noexcept;
  std::optional<layout::ChunkRef> tryFind(const std::byte* data) const noexcept;

 private:
  struct Bulk {
    Segment segment;
    std::size_t chunkBytes{};
    std::uint32_t chunkCount{};
  };
  bool tryMap(std::uint32_t number);
  PoolPlace place_;
  std::uint64_t maxBytes_;  // that the peer may have us map
  std::uint64_t bytes_ = 0;
  layout::ReturnRing* returns_;
  std::uint64_t returned_ = 0;
  std::vector<Bulk> bulks_;  // index = segment number; empty where not mapped
};

// Removes the bulk segments of a link, of both sides; the last ones first, as their owner does:
// whoever is killed meanwhile leaves no gap in their numbers, behind which nobody would look.
void removeBulk(const std::string& backplane, std::uint64_t link);

}  // namespace mpf
