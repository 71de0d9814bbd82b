// SPDX-License-Identifier: MIT
// Pool: memory for messages that do not fit into a ring. Each side of a link owns one pool and
// borrows from the pool of the other side.
//
//   owner     allocate ─► build the body in place ─► send a ChunkRef through the ring
//   borrower  read in place ─► return the chunk (ReturnRing), or send it back in a reply
//
// A bulk segment contains chunks of one size: a power of two plus room for a header. It is created
// when it is first needed, so a link that sends only small messages uses no memory here. When the
// limit or /dev/shm leaves no room, segments without a chunk in use give their memory back:
//
//   reserved ─► released: the memory of its chunks is a hole in the file ─► reserved
//
// The file, its name and its mappings stay, so a number never refers to another segment.
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

#include "base/step.h"
#include "shm/fan_out_loans.h"
#include "shm/fork_guard.h"
#include "shm/layout.h"
#include "shm/segment.h"

namespace mpf {

struct Chunk {
  std::byte* data{};
  std::size_t capacity{};
  bool isFanOut = false;  // a client received it from the server's fan-out pool
  std::uint32_t missed = 0;  // as in layout::ChunkRef
};
// The position of a chunk in a pool. Functions on the path of a message that take or return one are
// inline: otherwise g++ stores its numbers one by one and loads both at once, and such a load waits
// for the stores.
struct ChunkPlace {
  std::uint32_t segment{};
  std::uint32_t chunk{};
  friend bool operator==(const ChunkPlace&, const ChunkPlace&) = default;
};

// Identifies the pool of one side of a link.
struct PoolPlace {
  std::string_view backplane;  // its text outlives the pool: there may be many thousands of pools
  std::uint64_t link{};
  std::uint32_t side{};
  std::uint64_t ownerWindow{};
};

// The size of the chunks of a bulk segment.
class ChunkSize {
 public:
  ChunkSize() noexcept = default;
  explicit ChunkSize(std::uint64_t bytes) noexcept
      : bytes_(bytes), inverse_(UINT64_MAX / bytes + 1) {}
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
  // The chunk that contains the byte at `offset` from the first chunk. Multiplies by 2^64 / bytes,
  // because a division takes much longer; exact for the start of each chunk, and everywhere in the
  // first 4 GiB.
  [[nodiscard]] std::uint32_t chunkAt(std::uint64_t offset) const noexcept {
    __extension__ using Product = unsigned __int128;
    return static_cast<std::uint32_t>(Product{offset} * inverse_ >> 64);
  }

 private:
  std::uint64_t bytes_ = 0;
  std::uint64_t inverse_ = 0;
};

// The chunk of a pointer into one of these bulk segments.
template <class Bulks>
[[gnu::always_inline]] inline std::optional<ChunkPlace> tryFindIn(const Bulks& bulks,
                                                                  const std::byte* data) noexcept {
  for (std::uint32_t number = 0; number < bulks.size(); ++number) {
    const auto& segment = bulks[number].segment;
    if (!segment) continue;
    const auto offset =
        reinterpret_cast<std::uintptr_t>(data) - reinterpret_cast<std::uintptr_t>(segment.data());
    if (offset < layout::kBulkChunksOffset || offset >= segment.bytes()) continue;
    return ChunkPlace{number, bulks[number].chunkSize.chunkAt(offset - layout::kBulkChunksOffset)};
  }
  return std::nullopt;
}

class PoolOwner {
 public:
  PoolOwner(PoolPlace place, Rights rights, std::uint64_t maxBytes, layout::ReturnRing& returns);
  ~PoolOwner();
  PoolOwner(PoolOwner&&) = default;

  // Returns nullopt if the limit of the link is reached, /dev/shm is full, or the peer holds too
  // many chunks.
  std::optional<Chunk> tryAlloc(std::size_t bytes) noexcept;
  // Whether the limit of the link permits a chunk of this size.
  [[nodiscard]] bool isWithinLimit(std::size_t bytes) const noexcept;
  // Gives the chunk to the peer, until the peer returns it.
  void lend(ChunkPlace place) noexcept {
    bulks_[place.segment].states[place.chunk] = ChunkState::lent;
  }
  // Takes back a chunk that the peer sent in a message; nullopt if we had not lent it.
  [[gnu::always_inline]] std::optional<Chunk> tryReceiveBack(ChunkPlace place) noexcept {
    if (!isLent(place)) return std::nullopt;
    auto& bulk = bulks_[place.segment];
    bulk.states[place.chunk] = ChunkState::held;
    MPF_STEP(chunk_back);
    return Chunk{bulk.chunk(place.chunk), bulk.chunkSize.bytes()};
  }
  // Frees a chunk that is not lent.
  [[gnu::always_inline]] void free(ChunkPlace place) noexcept {
    auto& bulk = bulks_[place.segment];
    bulk.states[place.chunk] = ChunkState::free;
    bulk.free.push_back(place.chunk);
    --inUse_;
  }
  // The chunk of a pointer; nullopt if the pointer is not into this pool.
  [[nodiscard, gnu::always_inline]] std::optional<ChunkPlace> tryFind(
      const std::byte* data) const noexcept {
    return tryFindIn(bulks_, data);
  }
  // Whether a segment was created, and so has a name, even if its memory was released.
  [[nodiscard]] bool hasSegments() const noexcept { return !bulks_.empty(); }
  // Memory of the segments of this pool that are not released.
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
    ChunkSize chunkSize;
    std::vector<ChunkState> states;
    std::vector<std::uint32_t> free;  // empty while released
    void freeAll() noexcept;  // `free` has reserved memory for all chunks
    [[nodiscard]] bool isIdle() const noexcept { return free.size() == states.size(); }
    [[nodiscard]] bool isReleased() const noexcept;
    [[nodiscard]] std::byte* chunk(std::uint32_t index) const {
      return segment.data() + layout::kBulkChunksOffset + index * chunkSize.bytes();
    }
  };
  bool tryGrow(std::size_t chunkBytes) noexcept;
  bool addBulk(std::size_t chunkBytes) noexcept;
  bool tryReserveReleased(std::size_t chunkBytes) noexcept;
  bool tryMakeRoom(std::uint64_t bytes) noexcept;
  bool tryRelease(Bulk& bulk) noexcept;
  [[nodiscard]] std::uint64_t room() const noexcept { return maxBytes_ - bytes_; }
  [[nodiscard]] bool isLent(ChunkPlace place) const noexcept {
    return place.segment < bulks_.size() && place.chunk < bulks_[place.segment].states.size() &&
           bulks_[place.segment].states[place.chunk] == ChunkState::lent;
  }

  ForkGuard forkGuard_;
  PoolPlace place_;
  Rights rights_;
  std::uint64_t maxBytes_;
  std::uint64_t bytes_ = 0;  // of segments that are not released
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
      : place_(place), maxBytes_(maxBytes), returns_(&returns) {}

  // Maps a chunk that the peer sent; nullopt if there is no such chunk.
  //   throws  std::system_error, std::bad_alloc: no free descriptor or no memory to map it
  std::optional<Chunk> tryBorrow(ChunkPlace place);
  // As tryBorrow(), but maps nothing: nullopt if the segment is not mapped.
  [[gnu::always_inline]] std::optional<Chunk> tryBorrowMapped(ChunkPlace place) noexcept {
    if (!isMapped(place.segment)) return std::nullopt;
    const auto& bulk = bulks_[place.segment];
    if (place.chunk >= bulk.chunkCount || bulk.segment.isLost()) return std::nullopt;
    const auto bytes = bulk.chunkSize.bytes();
    return Chunk{bulk.segment.data() + layout::kBulkChunksOffset + place.chunk * bytes, bytes};
  }
  // Return a chunk to the peer's pool, or to its fan-out pool.
  void giveBack(ChunkPlace place) noexcept {
    returnPacked(place.segment * layout::kMaxChunks + place.chunk % layout::kMaxChunks);
  }
  void giveBackFanOut(std::uint32_t number) noexcept {
    returnPacked(layout::kReturnsFanOut | number);
  }
  [[nodiscard, gnu::always_inline]] std::optional<ChunkPlace> tryFind(
      const std::byte* data) const noexcept {
    return tryFindIn(bulks_, data);
  }

 private:
  struct Bulk {
    Segment segment;
    ChunkSize chunkSize;
    std::uint32_t chunkCount{};
  };
  [[nodiscard]] bool isMapped(std::uint32_t number) const noexcept {
    return number < bulks_.size() && bulks_[number].segment;
  }
  bool tryMap(std::uint32_t number);
  void returnPacked(std::uint32_t packed) noexcept;
  PoolPlace place_;
  std::uint64_t maxBytes_;  // of one segment
  std::uint64_t bytes_ = 0;  // mapped; some of it may be released
  layout::ReturnRing* returns_;
  std::uint64_t returned_ = 0;
  std::vector<Bulk> bulks_;  // index = segment number; empty where not mapped
};

// Removes the bulk segments of both sides of a link. Removes the last ones first, as their owner
// does: a process that is killed in between leaves no gap in the numbers. Segments after a gap
// would not be found.
void removeBulk(std::string_view backplane, std::uint64_t link) noexcept;

}  // namespace mpf
