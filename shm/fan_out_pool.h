// SPDX-License-Identifier: MIT
// FanOutPool: memory for messages that a server sends to many clients without a copy for each.
//
//   FanOutChunk = one segment with one chunk
//   holders     = the message of the server, and each link that has lent the chunk to its client
//
//   allocate ─► build the body in place ─► lend to any number of links ─► no holder: free again
//                                                                      └► retired: removed
//
// Threads  any.
// Crash    the segments belong to the window of the server, and are removed with it.
// Trust    clients can neither write the segments nor the counts, which are memory of the server.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "shm/fork_guard.h"
#include "shm/layout.h"
#include "shm/segment.h"

namespace mpf {

class FanOutChunk {
 public:
  FanOutChunk(Segment segment, std::uint32_t number) noexcept
      : segment_(std::move(segment)), number_(number) {}

  [[nodiscard]] std::byte* data() const noexcept {
    return segment_.data() + layout::kBulkChunksOffset;
  }
  [[nodiscard]] std::size_t capacity() const noexcept {
    return segment_.bytes() - layout::kBulkChunksOffset;
  }
  [[nodiscard]] std::uint32_t number() const noexcept { return number_; }
  [[nodiscard]] const Segment& segment() const noexcept { return segment_; }

  // For a caller that knows that there is a holder already.
  void hold() noexcept { holders_.fetch_add(1, std::memory_order_relaxed); }
  void drop() noexcept {
    // PAIR(fan-out-dropped): this holder has finished with the chunk.
    holders_.fetch_sub(1, std::memory_order_release);
  }
  // A client may read the chunk for ever, although it no longer counts as a holder: it must not be
  // written again. Called by a holder.
  void retire() noexcept { isRetired_.store(true, std::memory_order_relaxed); }

 private:
  friend class FanOutPool;
  // Becomes the first holder of a free chunk.
  [[nodiscard]] bool tryClaim() noexcept;
  [[nodiscard]] bool isAbandoned() const noexcept {
    // PAIR(fan-out-dropped): the last holder has finished; sees whether it has retired the chunk.
    return holders_.load(std::memory_order_acquire) == 0 &&
           isRetired_.load(std::memory_order_relaxed);
  }

  Segment segment_;
  std::uint32_t number_;
  std::atomic<std::uint32_t> holders_{1};
  std::atomic<bool> isRetired_{false};
};

class FanOutPool {
 public:
  //   clients  the rights of the server's clients; they may read at most
  FanOutPool(std::string backplane, std::uint64_t serverWindow, const Rights& clients,
             std::uint64_t maxBytes);
  // Removes the names. The memory stays as long as a process uses it.
  ~FanOutPool();
  FanOutPool(const FanOutPool&) = delete;
  FanOutPool& operator=(const FanOutPool&) = delete;

  // A chunk of at least `bytes`, of which the caller is the only holder. Returns nullptr if the
  // limit is reached and all chunks have holders, or /dev/shm is full.
  std::shared_ptr<FanOutChunk> tryAlloc(std::size_t bytes) noexcept;
  // The chunk that contains `data`; nullptr if it is not in this pool.
  std::shared_ptr<FanOutChunk> tryFind(const std::byte* data) const noexcept;
  // Removes the retired chunks that have no holder.
  void removeRetired() noexcept;
  // Memory of all segments.
  [[nodiscard]] std::uint64_t bytes() const noexcept;

 private:
  std::shared_ptr<FanOutChunk> tryReuse(std::size_t bytes) noexcept;
  bool tryMakeRoom(std::size_t bytes) noexcept;
  std::shared_ptr<FanOutChunk> tryCreate(std::size_t bytes, std::uint32_t number) noexcept;
  std::shared_ptr<FanOutChunk> create(std::size_t bytes, std::uint32_t number) const;
  void remove(std::size_t index) noexcept;

  ForkGuard forkGuard_;
  std::string backplane_;
  std::uint64_t serverWindow_;
  Rights rights_;
  std::uint64_t maxBytes_;
  mutable std::mutex mutex_;  // for the rest
  std::vector<std::shared_ptr<FanOutChunk>> chunks_;
  std::uint64_t bytes_ = 0;
  std::uint32_t created_ = 0;  // number of the next segment; no number is used twice
};

}  // namespace mpf
