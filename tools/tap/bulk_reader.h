// SPDX-License-Identifier: MIT
// BulkReader: copies bodies out of the pools of a link and the fan-out pool of its server, without
// the help of its two processes.
//
// Threads  one.
// Crash    the pool of a removed link stays readable as long as its segments are mapped here.
// Trust    a ChunkRef that does not fit its segment is refused with a SegmentError.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "shm/segment.h"

namespace mpf::tools {

class BulkReader {
 public:
  BulkReader(std::string backplane, std::uint64_t link, std::uint64_t serverWindow)
      : backplane_(std::move(backplane)), link_(link), serverWindow_(serverWindow) {}

  // The first `bytes` bytes of the chunk.
  //   throws  SegmentError, std::system_error, std::bad_alloc
  [[nodiscard]] std::vector<std::byte> read(const layout::ChunkRef& ref, std::size_t bytes);

 private:
  const Segment& open(const layout::ChunkRef& ref);
  std::string backplane_;
  std::uint64_t link_;
  std::uint64_t serverWindow_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Segment> segments_;  // by side and number
};

}  // namespace mpf::tools
