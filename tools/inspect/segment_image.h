// SPDX-License-Identifier: MIT
// SegmentImage: a private copy of the beginning of a segment. It is read with pread(): nothing is
// mapped, locked or written, so that reading disturbs no process, and a segment that shrinks causes
// no SIGBUS.
//
// Threads  one.
// Crash    the owner may die at any time; the copy stays.
// Trust    header() has been checked; everything else is untrusted.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "shm/layout.h"

namespace mpf::tools {

class SegmentImage {
 public:
  // The largest segment of any kind, not counting the chunks of a pool: a link with the longest
  // rings.
  static constexpr std::size_t kMostBytes =
      layout::linkBytes(layout::kMaxRingSlots, layout::kMaxRingSlots, layout::kMaxRingSlots);

  // Up to `bytes` of the segment; bytes behind the end of the file are zero. nullopt when no
  // segment of that name exists (any more).
  //   throws  SegmentError when the file is not a segment of this kind, std::system_error when it
  //           may not be read
  static std::optional<SegmentImage> tryRead(const std::string& name, layout::SegmentKind kind,
                                             std::size_t bytes);
  // The same for a file of any kind in any folder, for example a copy. Reads the whole segment, but
  // only the header of a bulk segment.
  static std::optional<SegmentImage> tryReadFile(const std::string& path);
  // The same for an open file, which may have lost its name. `path` is for error messages. Without
  // `kind`, any kind will do.
  //   throws  as tryRead()
  static SegmentImage readOpen(int file, const std::string& path,
                               std::optional<layout::SegmentKind> kind = std::nullopt,
                               std::size_t bytes = kMostBytes);

  [[nodiscard]] const layout::SegmentHeader& header() const noexcept {
    return at<layout::SegmentHeader>(0);
  }
  [[nodiscard]] const layout::WindowControl& window() const noexcept {
    return at<layout::WindowControl>(layout::kWindowControlOffset);
  }
  [[nodiscard]] const layout::LinkControl& link() const noexcept {
    return at<layout::LinkControl>(layout::kLinkControlOffset);
  }
  [[nodiscard]] const layout::WindowHints& hints() const noexcept {
    return at<layout::WindowHints>(0);
  }
  // The rows of a router, as far as the copy contains them.
  [[nodiscard]] std::span<const layout::RouterLine> routerLines() const noexcept;
  // Whether the lengths of the rings of a link are valid, and the copy contains all of them.
  [[nodiscard]] bool hasRings() const noexcept;
  // The rings of a link that has them. Replies that continue in the second ring appear as one ring,
  // with those of the first one that the second one has not overwritten.
  [[nodiscard]] std::span<const layout::Slot> requestSlots() const noexcept;
  [[nodiscard]] std::span<const layout::Slot> replySlots() const noexcept;
  // The bytes that were read.
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return {reinterpret_cast<const std::byte*>(blocks_.get()), bytesRead_};
  }
  [[nodiscard]] std::uint64_t fileBytes() const noexcept { return fileBytes_; }

 private:
  // Slots of a link, of all rings together.
  [[nodiscard]] std::span<layout::Slot> slots(std::size_t first, std::size_t count) const noexcept;
  void joinReplyRings() noexcept;
  // Reads up to `bytes` of a file; nullopt when it does not exist. Without `kind`, any kind will
  // do.
  static std::optional<SegmentImage> tryLoad(const std::string& path,
                                             std::optional<layout::SegmentKind> kind,
                                             std::size_t bytes);
  struct alignas(layout::kPairBytes) Block {
    std::byte bytes[layout::kPairBytes];
  };
  template <class T>
  [[nodiscard]] const T& at(std::size_t offset) const noexcept {
    return *reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(blocks_.get()) + offset);
  }
  std::unique_ptr<Block[]> blocks_;
  std::size_t bytesRead_ = 0;
  std::uint64_t fileBytes_ = 0;
};

// The value of a word in an image. Relaxed, because no process writes to the copy.
template <class Word>
[[nodiscard]] auto value(const Word& word) noexcept {
  return word.load(std::memory_order_relaxed);
}

}  // namespace mpf::tools
