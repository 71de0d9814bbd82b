// SPDX-License-Identifier: MIT
// OwnerLock: the kernel's lock on a segment's file that says whether its owner lives.
//
//   byte     0                1                2 ...
//   owner    ├──────────── write lock on the whole file ──────────►
//   reaper                    ├ write lock ┤                        it removes the name of a dead owner
//
// Only a write lock says anything: whoever may read the file may place a read lock on it, and keep
// it for as long as it likes.
//
// Threads  any.
// Crash    the kernel drops the locks of a process that ends.
// Trust    a read lock of a stranger keeps neither the dead alive nor a reaper from its work.
#pragma once

#include <string>

#include <mpf/file_descriptor.h>

#include "shm/layout.h"

namespace mpf::owner_lock {

// Places the owner's lock. The kernel keeps it until the last descriptor of this open file is
// closed.
[[nodiscard]] bool trySet(int fd) noexcept;
// Whether somebody holds a write lock where an owner has one. An error counts as held: it proves
// nothing.
[[nodiscard]] bool isHeld(int fd) noexcept;
// The same, by a process that may be the owner: the one that `header` names has not ended.
[[nodiscard]] bool isHeldByOwner(int fd, const layout::SegmentHeader& header) noexcept;

// The right to remove the name of a dead window. Of all processes of this host only one has it at a
// time.
//
//   write lock on byte 1 granted ──────────────────────────────► ours, unless a reaper's file is locked
//   refused: strangers hold locks ─► lock on a reaper's file ──► ours, unless another reaper has byte 1
//
// A reaper's file is open to its creator alone, so that no stranger can lock it. It exists only
// while it is needed.
class Reaper {
 public:
  //   file         the window's, open for writing
  //   reaperFile   name of the reaper's file; empty: there is none for this window
  Reaper(const FileDescriptor& file, std::string reaperFile);
  ~Reaper();
  Reaper(const Reaper&) = delete;
  Reaper& operator=(const Reaper&) = delete;

  [[nodiscard]] bool mayRemove() const noexcept { return mayRemove_; }

 private:
  bool tryBesideStrangers(int fd);
  std::string reaperFile_;
  FileDescriptor ownLock_;
  bool mayRemove_ = false;
};

// Removes a reaper's file that a killed reaper left. False: another process uses it, or this user
// may not.
bool removeReaperFile(const std::string& name);

}  // namespace mpf::owner_lock
