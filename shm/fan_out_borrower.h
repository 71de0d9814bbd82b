// SPDX-License-Identifier: MIT
// FanOutBorrower: the chunks of the server's fan-out pool that the client of one link reads.
//
// Each chunk that is held has a mapping of its own, copy-on-write: what the client writes to one
// message appears in no other message, and in no other process.
//
// Threads  the caller serialises all functions; Link does.
// Crash    mappings stay valid when the server removes the files or dies.
// Trust    a reference that names no segment of the server is refused. A server can make a client
//          map as many segments as the client holds messages, but at most kMaxMappings.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "shm/layout.h"
#include "shm/pool.h"
#include "shm/segment.h"

namespace mpf {

class FanOutBorrower {
 public:
  static constexpr std::size_t kMaxMappings = 256;

  //   backplane   its text outlives this object
  FanOutBorrower(std::string_view backplane, std::uint64_t serverWindow)
      : backplane_(backplane), serverWindow_(serverWindow) {}

  // Maps a chunk that the server sent; nullopt if there is no such chunk. `missed`: as in the
  // reference to it.
  //   throws  std::system_error, std::bad_alloc: no free descriptor or no memory to map it
  std::optional<Chunk> tryBorrow(ChunkPlace place, std::uint32_t missed);
  // Ends the use of a chunk and returns its number, which the caller returns to the server; nullopt
  // if `data` is not the start of one that is held.
  std::optional<std::uint32_t> tryRelease(const std::byte* data) noexcept;

 private:
  struct View {
    Segment segment;
    std::uint32_t number{};
    bool isHeld = false;
  };
  View* tryMap(std::uint32_t number);
  void unmapUnused() noexcept;

  std::string_view backplane_;
  std::uint64_t serverWindow_;
  std::vector<View> views_;
};

}  // namespace mpf
