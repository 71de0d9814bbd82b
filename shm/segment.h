// SPDX-License-Identifier: MIT
// Segment: one file in /dev/shm: creates, locks, publishes, opens, maps and checks it.
//
//   create() ─► no name yet, memory reserved ─► fill in the header ─► lockForLife() ─► tryPublish()
//
// A segment gets its name in the last step. Therefore no process sees an incomplete segment, and a
// process that is killed before this step leaves nothing.
//
// Threads  one thread creates or opens a segment; then any thread may use the mapping.
// Crash    the kernel releases the lock of a dead owner. Only then does removeIfOwnerless() remove
//          the file.
// Trust    the header is copied and checked before any other byte is used.
#pragma once

#include <sys/types.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <mpf/errors.h>
#include <mpf/file_descriptor.h>
#include <mpf/rights.h>

#include "base/printable.h"
#include "shm/layout.h"
#include "shm/mapping.h"

namespace mpf {

// Sets the mode, group and user of an open file.
//   throws  std::system_error: only root may change the user, and only members of a group may give
//           a file to it
void setRights(int fd, const Rights& rights);

// All users may read the segment, as tools and routers do.
inline constexpr Rights kReadableByAll{.mode = 0644};

class Segment {
 public:
  using Access = Mapping::Access;

  Segment() = default;

  // Creates a segment of `bytes` zeroes and fills in the header fields that all kinds share. Only
  // the first `reservedBytes` get memory; the others must not be accessed before tryReserve().
  //   throws  std::system_error; ENOSPC if /dev/shm does not have enough free memory
  static Segment create(std::size_t bytes, layout::SegmentKind kind, std::string_view backplane,
                        Rights rights, std::size_t reservedBytes);
  static Segment create(std::size_t bytes, layout::SegmentKind kind, std::string_view backplane,
                        Rights rights) {
    return create(bytes, kind, backplane, rights, bytes);
  }
  // Gives all bytes memory. Opens the file by its name. Returns false if /dev/shm does not have
  // enough free memory, the process has no file descriptor left, or the name was removed.
  [[nodiscard]] bool tryReserve() const noexcept;
  // Gives the memory from offset `from` on back to the system. The length of the file and all
  // mappings stay; the bytes must not be accessed before tryReserve(). Returns false if the file
  // cannot be opened by its name.
  [[nodiscard]] bool tryRelease(std::size_t from) const noexcept;

  // Holds the owner's lock until this object is destroyed or the process ends. If a peer truncates
  // the file, the guard grows it again.
  void lockForLife();
  // Before tryPublish(), for users of header(): the fields of sharedHeader() are filled in.
  void completeHeader() { header_ = sharedHeader(); }
  // Completes the header, and gives the file its name. Returns false if another file has this name.
  [[nodiscard]] bool tryPublish(const std::string& name);

  // Maps an existing segment; nullopt if no file has this name.
  //   throws  SegmentError if the file is not a usable segment of this kind, std::system_error if
  //           it cannot be opened
  static std::optional<Segment> tryOpen(const std::string& name, layout::SegmentKind kind,
                                        Access access);

  // Maps the first `bytes` of a segment that every peer may write. Ignores its header, which a peer
  // may have overwritten. If a peer truncates the file, before or after the call, it is grown
  // again. nullopt if no file has this name.
  //   throws  SegmentError if the file is too short and has no owner, or is not a regular file;
  //           std::system_error if it cannot be opened
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
  // Whether the file was truncated and could not be grown: the memory is now private zeroes.
  [[nodiscard]] bool isLost() const noexcept { return mapping_.isLost(); }

  template <class T>
  [[nodiscard]] T& at(std::size_t offset) const {
    return *reinterpret_cast<T*>(data() + offset);
  }

  // The next five must be called before closeFile().
  // Whether the file still has its name: another process may have removed it, and another file may
  // have it now.
  [[nodiscard]] bool hasName() const noexcept;
  // Number of the user that owns the file; ~0 if the system does not tell.
  [[nodiscard]] std::uint32_t fileUser() const noexcept;
  // Whether the owner is alive, as probeOwner() finds out, even if the file has lost its name.
  [[nodiscard]] bool hasOwner() const noexcept;
  // Whether any process holds the owner's lock.
  [[nodiscard]] bool isLocked() const noexcept;
  void setRights(const Rights& rights) const { mpf::setRights(file_.get(), rights); }
  // Closes the file and keeps the mapping. For segments without a lock.
  void closeFile() { file_.reset(); }

 private:
  // Opens the file again for writing; empty if the name refers to no file, or to another one.
  [[nodiscard]] FileDescriptor reopen() const noexcept;

  FileDescriptor file_;
  Mapping mapping_;
  layout::SegmentHeader header_{};
  std::string name_;
};

namespace segments {

// Removes the name. Returns false if there was no such name, or this user may not remove it.
// Needs no memory.
bool remove(const char* name) noexcept;
inline bool remove(const std::string& name) noexcept { return remove(name.c_str()); }
[[nodiscard]] bool exists(const char* name) noexcept;
[[nodiscard]] inline bool exists(const std::string& name) noexcept { return exists(name.c_str()); }

// Copies the header and checks it as Segment::tryOpen does, without mapping the file; nullopt if no
// file has this name.
//   throws  as Segment::tryOpen
std::optional<layout::SegmentHeader> tryReadHeader(const std::string& name,
                                                   layout::SegmentKind kind);

enum class Owner { alive, dead, absent };
// Asks the kernel whether the owner of a window is alive: a process holds the owner's lock, and the
// process that the header names has not ended, as far as this process can find out. With an
// incarnation: `absent` also if a window of another incarnation has the name now.
[[nodiscard]] Owner probeOwner(const std::string& name, std::uint64_t incarnation = 0);
// What one look at a window has found.
struct Probed {
  layout::SegmentHeader header;
  std::uint32_t user;  // owner of the file
  bool isLocked;  // a process holds the owner's lock
  bool hasOwner;  // as probeOwner()
};
// Looks at a window; nullopt if no file has this name.
//   throws  as Segment::tryOpen
std::optional<Probed> tryProbe(const std::string& name, layout::SegmentKind kind);
// The user that owns a file; nullopt if no file has this name.
[[nodiscard]] std::optional<std::uint32_t> userOf(const std::string& name);
// Whether both files exist and belong to the same user.
[[nodiscard]] bool haveSameUser(const std::string& one, const std::string& other);
// Whether any process holds a write lock on the byte of the owner's lock.
[[nodiscard]] bool isLocked(const std::string& name);
// Removes a window whose owner is proven dead. Two processes may try at once. Does not remove a
// window that has replaced the dead one, nor a file that is not a window of a known version,
// because its lock may have another meaning.
bool removeIfOwnerless(const std::string& name);
// As removeIfOwnerless(), for client windows and hints, whatever their contents: a name with an
// incarnation and the lock of such a file have the same meaning in all versions.
bool removeKeyedIfOwnerless(const std::string& name);

// Names in /dev/shm that start with `prefix`.
std::vector<std::string> list(const std::string& prefix);

// Path of a segment's file.
std::string path(const std::string& name);
// The same for functions that must not fail: a text that ends with 0, and needs no memory.
using PathText = std::array<char, 512>;
[[nodiscard]] PathText pathText(const char* name) noexcept;

// A text of a header, unchanged, for comparisons and for other programs.
template <std::size_t n>
std::string rawText(const std::array<char, n>& chars) {
  return {chars.begin(), std::find(chars.begin(), chars.end(), '\0')};
}

// A text of a header, escaped, for people: any process that may write to /dev/shm chooses it.
template <std::size_t n>
std::string text(const std::array<char, n>& chars) {
  return printable(rawText(chars));
}

// 64 random bits, never 0.
std::uint64_t newIncarnation();

// Throws SegmentError, which names `path`, unless `header` is the header of a usable segment of
// this kind in a file of `fileBytes`.
void check(const layout::SegmentHeader& header, std::size_t fileBytes, layout::SegmentKind kind,
           const std::string& path);

}  // namespace segments
}  // namespace mpf
