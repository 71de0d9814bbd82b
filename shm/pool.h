// SPDX-License-Identifier: MIT
// Pool: memory for messages that do not fit into a ring. Each side of a link owns one pool and
// borrows from the pool of the other side.
//
//   owner     allocate ─► build the body in place ─► send a ChunkRef through the ring
//   borrower  read in place ─► return the chunk (ReturnRing), or send it back in a reply
//
// A bulk segment contains chunks of one size: a power of two plus room for a header. It is created
// when it is first needed, so a link that sends only small messages uses no memory here.
//
// Threads  the caller serialises all functions; Link does.
// Crash    bulk segments belong to their link, and are removed with it.
// Trust    a ChunkRef from a peer is checked against the chunks that were mapped or lent; an
//          invalid one is refused.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "shm/fan_out_loans.h"
#include "shm/fork_guard.h"
#include "shm/layout.h"
#include "shm/segment.h"

namespace mpf {

struct Chunk {
  std::byte* data{};
  std::size_t capacity{};
  layout::ChunkRef ref{};
};

// Identifies the pool of one side of a link.
struct PoolPlace {
  std::string_view backplane;  // its text outlives the pool: there may be many thousands of pools
  std::uint64_t link{};
  std::uint32_t side{};
  std::uint64_t ownerWindow{};
};

class PoolOwner {
 public:
  PoolOwner(PoolPlace place, Rights rights, std::uint64_t maxBytes, layout::ReturnRing& returns);
  ~PoolOwner();
  PoolOwner(PoolOwner&&) = default;

  // Returns nullopt if the limit of the link is reached, /dev/shm is full, or the peer holds too
  // many chunks.
  std::optional<Chunk> tryAlloc(std::size_t bytes) noexcept;
  // Gives the chunk to the peer, until the peer returns it.
  void lend(const layout::ChunkRef& ref) noexcept;
  // Takes back a chunk that the peer sent in a message; nullopt if we had not lent it.
  std::optional<Chunk> tryReceiveBack(const layout::ChunkRef& ref) noexcept;
  // Frees a chunk that is not lent.
  void free(const layout::ChunkRef& ref) noexcept;
  // The chunk of a pointer; nullopt if the pointer is not into this pool.
  std::optional<layout::ChunkRef> tryFind(const std::byte* data) const noexcept;
  // Memory of all segments of this pool.
  [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_; }
  // Takes what the peer has returned through the ring.
  void collectReturned() noexcept;
  // What a client holds of the fan-out pool of its server. It is returned through the same ring.
  [[nodiscard]] FanOutLoans& loans() noexcept { return loans_; }
  // Whether another chunk, of either pool, fits into the ring of returns.
  [[nodiscard]] bool canLend() const noexcept {
    return inUse_ + loans_.count() < layout::kReturnSlots;
  }
  // Makes the destructor keep the names of the segments: the peer removes them.
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
  std::uint32_t inUse_ = 0;  // chunks held or lent
  FanOutLoans loans_;
  std::vector<Bulk> bulks_;
};

class PoolBorrower {
 public:
  PoolBorrower(PoolPlace place, std::uint64_t maxBytes, layout::ReturnRing& returns)
      : place_(std::move(place)), maxBytes_(maxBytes), returns_(&returns) {}

  // Maps a chunk that the peer sent; nullopt if there is no such chunk.
  //   throws  std::system_error, std::bad_alloc: no free descriptor or no memory to map it
  std::optional<Chunk> tryBorrow(const layout::ChunkRef& ref);
  // Returns a chunk to the peer, also one of its fan-out pool.
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
  std::uint64_t maxBytes_;  // most memory that the peer can make us map
  std::uint64_t bytes_ = 0;
  layout::ReturnRing* returns_;
  std::uint64_t returned_ = 0;
  std::vector<Bulk> bulks_;  // index = segment number; empty where not mapped
};

// Removes the bulk segments of both sides of a link. Removes the last ones first, as their owner
// does: a process that is killed in between leaves no gap in the numbers. Segments after a gap
// would not be found.
void removeBulk(std::string_view backplane, std::uint64_t link);

}  // namespace mpf
