// SPDX-License-Identifier: MIT
// Segment: one file in /dev/shm, created, locked, named, mapped, refused and removed.
//
//   create ─► (invisible, memory reserved) ─► fill in ─► lockForLife ─► publish under its name
//
// A segment gets its name last and at once, so nobody ever sees half of one, and a process killed
// before that leaves nothing.
//
// Threads  one thread creates or opens; the mapping may then be used by any.
// Crash    the kernel drops the lock of a dead owner; removeIfOwnerless() then removes the file,
//          and only then.
// Trust    the header is copied and checked before anything else is believed.
#pragma once

#include <sys/types.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <mpf/errors.h>
#include <mpf/file_descriptor.h>
#include <mpf/rights.h>

#include "base/printable.h"
#include "shm/layout.h"
#include "shm/mapping.h"

namespace mpf {

// Gives an open file these rights.
//   throws  std::system_error: only root gives files away, and to a group only its members do
void setRights(int fd, const Rights& rights);

class Segment {
 public:
  using Access = Mapping::Access;

  Segment() = default;

  // A zeroed segment of `bytes`, with header fields that are the same for all filled in.
  //   throws  std::system_error; ENOSPC when /dev/shm has not that much left
  static Segment create(std::size_t bytes, layout::SegmentKind kind, const std::string& backplane,
                        Rights rights);

  // Holds the owner's lock until this Segment dies or the process does. A peer that cuts the file
  // finds it grown again.
  void lockForLife();
  // False when another segment has the name.
  [[nodiscard]] bool tryPublish(const std::string& name);

  // Maps an existing segment. nullopt when there is none of that name, or its last link is gone.
  //   throws  SegmentError when it is not what it should be, std::system_error when it may not be
  //           opened
  static std::optional<Segment> tryOpen(const std::string& name, layout::SegmentKind kind,
                                        Access access);

  // The first `bytes` of a segment that every peer may write: its header may be nonsense by now,
  // and is not looked at. When a peer cuts the file, before or after, it is grown again. nullopt
  // when there is none of that name.
  //   throws  SegmentError when it is too short and nobody's, or no file, std::system_error when it
  //           may not be opened
  static std::optional<Segment> tryOpenShared(const std::string& name, std::size_t bytes);

  // A private copy, taken and checked when the segment was opened.
  [[nodiscard]] const layout::SegmentHeader& header() const { return header_; }
  [[nodiscard]] layout::SegmentHeader& sharedHeader() const {
    return *reinterpret_cast<layout::SegmentHeader*>(data());
  }
  [[nodiscard]] std::byte* data() const { return mapping_.data(); }
  [[nodiscard]] std::size_t bytes() const { return mapping_.bytes(); }
  [[nodiscard]] const std::string& name() const { return name_; }
  explicit operator bool() const { return data() != nullptr; }
  // Whether somebody cut the file: what is left is zeroes of our own.
  [[nodiscard]] bool isLost() const noexcept { return mapping_.isLost(); }

  template <class T>
  [[nodiscard]] T& at(std::size_t offset) const {
    return *reinterpret_cast<T*>(data() + offset);
  }

  // Whose file it is. Needs the file.
  [[nodiscard]] std::uint32_t fileUser() const;
  // Whether the owner lives, as probeOwner() says, whatever became of the name. Needs the file.
  [[nodiscard]] bool hasOwner() const noexcept;
  // Needs the file.
  void setRights(const Rights& rights) const { mpf::setRights(file_.get(), rights); }
  // Lets go of the file, not of the mapping. A segment without lock needs it no longer.
  void closeFile() { file_.reset(); }

 private:
  FileDescriptor file_;
  Mapping mapping_;
  layout::SegmentHeader header_{};
  std::string name_;
};

namespace segments {

// Removes the name. False when there was none.
bool remove(const std::string& name);
[[nodiscard]] bool exists(const std::string& name);

// A copy of the header, checked as when the segment is opened; nothing is mapped. nullopt when
// there is none of that name.
//   throws  as Segment::tryOpen
std::optional<layout::SegmentHeader> tryReadHeader(const std::string& name,
                                                   layout::SegmentKind kind);

enum class Owner { alive, dead, absent };
// Asks the kernel whether the owner of a window lives: a process holds the owner's lock, and the
// process that the header names has not ended, as far as this process can tell. With an
// incarnation: `absent` when the name has another one's window now.
[[nodiscard]] Owner probeOwner(const std::string& name, std::uint64_t incarnation = 0);
// Whether two files are there and belong to the same user.
[[nodiscard]] bool haveSameUser(const std::string& one, const std::string& other);
// Whether any process holds a write lock where an owner has one.
[[nodiscard]] bool isLocked(const std::string& name);
// Removes a window whose owner is proven dead. Two processes may try at once; a window that was
// replaced meanwhile stays, and so does what is no window of a version that we know: its lock may
// mean something else.
bool removeIfOwnerless(const std::string& name);
// The same of client windows and hints, whatever is written there by now: a name with an
// incarnation and its lock mean the same in all versions.
bool removeKeyedIfOwnerless(const std::string& name);

// Names in /dev/shm that start with `prefix`.
std::vector<std::string> list(const std::string& prefix);

// Path of a segment's file.
std::string path(const std::string& name);

// A text in a header as it is, for comparisons and for other programs.
template <std::size_t n>
std::string rawText(const std::array<char, n>& chars) {
  return {chars.begin(), std::find(chars.begin(), chars.end(), '\0')};
}

// The same for people: any process that may write to /dev/shm chooses these characters.
template <std::size_t n>
std::string text(const std::array<char, n>& chars) {
  return printable(rawText(chars));
}

// 64 random bits, never 0.
std::uint64_t newIncarnation();

// Throws SegmentError, naming `path`, when `header` (of a file of `fileBytes`) is not a usable one
// of `kind`.
void check(const layout::SegmentHeader& header, std::size_t fileBytes, layout::SegmentKind kind,
           const std::string& path);

}  // namespace segments
}  // namespace mpf
