// SPDX-License-Identifier: MIT
#include "tools/tap/bulk_reader.h"

#include <cstring>
#include <fmt/format.h>

#include "shm/segment_name.h"

namespace mpf::tools {

const Segment& BulkReader::open(const layout::ChunkRef& ref) {
  const auto key = std::pair(ref.side, ref.segment);
  if (const auto known = segments_.find(key); known != segments_.end()) return known->second;
  const bool isFanOut = ref.side == layout::kFanOutSide;
  const auto name = isFanOut ? SegmentName::fanOut(backplane_, serverWindow_, ref.segment)
                             : SegmentName::bulk(backplane_, link_, ref.side, ref.segment);
  auto segment =
      Segment::tryOpen(name, isFanOut ? layout::SegmentKind::fanOut : layout::SegmentKind::bulk,
                       Segment::Access::readOnly);
  if (!segment)
    throw SegmentError(fmt::format("{}: the pool no longer exists", segments::path(name)));
  segment->closeFile();
  return segments_.emplace(key, std::move(*segment)).first->second;
}

std::vector<std::byte> BulkReader::read(const layout::ChunkRef& ref, std::size_t bytes) {
  if (ref.side > layout::kFanOutSide)
    throw SegmentError(fmt::format(
        "a chunk of side {}; the sides of a link are 0 and 1, the fan-out pool is 2", ref.side));
  const auto& segment = open(ref);
  const auto& header = segment.header();
  const auto room =
      segment.bytes() < layout::kBulkChunksOffset ? 0 : segment.bytes() - layout::kBulkChunksOffset;
  if (header.chunkBytes == 0 || bytes > header.chunkBytes || ref.chunk >= header.chunkCount ||
      header.chunkCount > room / header.chunkBytes) {
    throw SegmentError(fmt::format("{}: {} bytes of chunk {} are not in {} chunks of {} bytes",
                                   segments::path(segment.name()), bytes, ref.chunk,
                                   header.chunkCount, header.chunkBytes));
  }
  std::vector<std::byte> body(bytes);
  std::memcpy(body.data(),
              segment.data() + layout::kBulkChunksOffset + ref.chunk * header.chunkBytes, bytes);
  return body;
}

}  // namespace mpf::tools
