// SPDX-License-Identifier: MIT
// SegmentImage: a private copy of the beginning of a segment. Read with pread(): nothing is mapped,
// locked or written, so that looking disturbs nobody, and a segment that shrinks meanwhile is no
// signal.
//
// Threads  one.
// Crash    the owner may die at any time; the copy stays.
// Trust    header() has been checked; all else is what its writers say.
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
  // Up to `bytes` of the segment; what the file does not have is zero. nullopt when there is no
  // segment of that name (any more).
  //   throws  SegmentError when it is not what it should be, std::system_error when it may not be
  //           read
  static std::optional<SegmentImage> tryRead(const std::string& name, layout::SegmentKind kind,
                                             std::size_t bytes);
  // The same of a file anywhere, a copy for example, and of any kind: all of it, but of a bulk
  // segment the header alone.
  static std::optional<SegmentImage> tryReadFile(const std::string& path);

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
  // Of a router; those that the copy has not are left out.
  [[nodiscard]] std::span<const layout::RouterLine> routerLines() const noexcept;
  // The slots of a link that begin at `offset`; those that the copy has not are left out.
  [[nodiscard]] std::span<const layout::Slot> slots(std::size_t offset,
                                                    std::size_t count) const noexcept;
  // What was read.
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return {reinterpret_cast<const std::byte*>(blocks_.get()), bytesRead_};
  }
  [[nodiscard]] std::uint64_t fileBytes() const noexcept { return fileBytes_; }

 private:
  // Opens a file and makes room for `bytes` of it; empty when there is none.
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

// A word of an image, which nobody writes any more.
template <class Word>
[[nodiscard]] auto value(const Word& word) noexcept {
  return word.load(std::memory_order_relaxed);
}

}  // namespace mpf::tools
