// SPDX-License-Identifier: MIT
#include "tools/inspect/segment_image.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fmt/format.h>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "shm/segment.h"

namespace mpf::tools {

namespace {

// The kind that a header contains, unchecked; 0 when the file is too short.
layout::SegmentKind kindOf(int file) noexcept {
  layout::SegmentKind kind{};
  static_cast<void>(::pread(file, &kind, sizeof kind, offsetof(layout::SegmentHeader, kind)));
  return kind;
}

}  // namespace

std::optional<SegmentImage> SegmentImage::tryRead(const std::string& name, layout::SegmentKind kind,
                                                  std::size_t bytes) {
  return tryLoad(segments::path(name), kind, bytes);
}

std::optional<SegmentImage> SegmentImage::tryReadFile(const std::string& path) {
  return tryLoad(path, std::nullopt, kMostBytes);
}

std::optional<SegmentImage> SegmentImage::tryLoad(const std::string& path,
                                                  std::optional<layout::SegmentKind> kind,
                                                  std::size_t bytes) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!file) {
    if (errno == ENOENT) return std::nullopt;
    throwSystemError(errno, "open", path);
  }
  return readOpen(file.get(), path, kind, bytes);
}

SegmentImage SegmentImage::readOpen(int file, const std::string& path,
                                    std::optional<layout::SegmentKind> kind, std::size_t bytes) {
  struct stat status{};
  checkCall(::fstat(file, &status), "look at", path);
  if (!S_ISREG(status.st_mode))
    throw SegmentError(fmt::format("{}: not a segment of MPF (not a regular file)", path));

  SegmentImage image;
  image.fileBytes_ = static_cast<std::uint64_t>(status.st_size);
  // The memory is large enough for all accessors, even if the file is shorter.
  constexpr auto kLeast =
      std::max({layout::kWindowBytes, layout::kLinkRingsOffset, sizeof(layout::WindowHints)});
  const auto found = kindOf(file);
  const bool isPool = found == layout::SegmentKind::bulk || found == layout::SegmentKind::fanOut;
  const auto most = kind || !isPool ? bytes : layout::kHeaderBytes;
  const auto wanted = std::min<std::uint64_t>(most, image.fileBytes_);
  image.blocks_ = std::make_unique<Block[]>(
      (std::max<std::size_t>(wanted, kLeast) + sizeof(Block) - 1) / sizeof(Block));
  image.bytesRead_ = static_cast<std::size_t>(
      checkCall(::pread(file, image.blocks_.get(), wanted, 0), "read", path));
  if (image.bytesRead_ < layout::kHeaderBytes) {
    throw SegmentError(
        fmt::format("{}: truncated, {} bytes are too few for a header", path, image.bytesRead_));
  }
  segments::check(image.header(), image.fileBytes_, kind.value_or(image.header().kind), path);
  if (image.header().kind == layout::SegmentKind::link) image.joinReplyRings();
  return image;
}

std::span<const layout::RouterLine> SegmentImage::routerLines() const noexcept {
  if (bytesRead_ < layout::kRouterLinesOffset) return {};
  const auto rows = (bytesRead_ - layout::kRouterLinesOffset) / sizeof(layout::RouterLine);
  return {&at<layout::RouterLine>(layout::kRouterLinesOffset),
          std::min<std::size_t>(rows, layout::kRouterLines)};
}

bool SegmentImage::hasRings() const noexcept {
  const auto isRing = [](std::uint32_t slots) {
    return std::has_single_bit(slots) && slots >= 16 && slots <= layout::kMaxRingSlots;
  };
  const auto& known = header();
  return isRing(known.queueSlots) && isRing(known.replySlots) &&
         (known.moreReplySlots == 0 || isRing(known.moreReplySlots)) &&
         bytesRead_ >= layout::linkBytes(known.queueSlots, known.replySlots, known.moreReplySlots);
}

std::span<layout::Slot> SegmentImage::slots(std::size_t first, std::size_t count) const noexcept {
  auto* const bytes = reinterpret_cast<std::byte*>(blocks_.get()) + layout::kLinkRingsOffset;
  return {reinterpret_cast<layout::Slot*>(bytes) + first, count};
}

std::span<const layout::Slot> SegmentImage::requestSlots() const noexcept {
  return slots(0, header().queueSlots);
}

std::span<const layout::Slot> SegmentImage::replySlots() const noexcept {
  const auto& known = header();
  const bool hasMoved =
      known.moreReplySlots != 0 && link().repliesMoved.load(std::memory_order_relaxed) != 0;
  return hasMoved ? slots(std::size_t{known.queueSlots} + known.replySlots, known.moreReplySlots)
                  : slots(known.queueSlots, known.replySlots);
}

// Copies the messages of the first ring to the places that their positions have in the second one.
// A slot of the second ring that has been used keeps its message: it is newer.
void SegmentImage::joinReplyRings() noexcept {
  const auto& known = header();
  const auto moved = link().repliesMoved.load(std::memory_order_relaxed);
  if (!hasRings() || known.moreReplySlots == 0 || moved == 0) return;
  const auto first = slots(known.queueSlots, known.replySlots);
  const auto second = slots(std::size_t{known.queueSlots} + known.replySlots, known.moreReplySlots);
  const layout::Slot empty{};
  const auto end = moved - 1;
  for (auto position = end - std::min<std::uint64_t>(end, first.size() - 1); position < end;
       ++position) {
    auto* const to = static_cast<void*>(&second[position % second.size()]);
    if (std::memcmp(to, static_cast<const void*>(&empty), sizeof empty) != 0) continue;
    std::memcpy(to, static_cast<const void*>(&first[position % first.size()]), sizeof empty);
  }
}

}  // namespace mpf::tools
