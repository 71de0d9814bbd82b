// SPDX-License-Identifier: MIT
// OwnerLock: the kernel's lock on a segment's file that proves that the owner is alive. A reaper is
// a process that removes the name of a window whose owner is dead.
//
//   byte     0                1                2 ...
//   owner    ├──────────── write lock on the whole file ──────────►
//   reaper                    ├ write lock ┤
//
// Only a write lock is evidence: every process that may read the file may place a read lock on it
// and hold it for any time. A stranger is a process that holds such a lock.
//
// Threads  any.
// Crash    the kernel releases the locks of a process that ends.
// Trust    a stranger's read lock neither makes a dead owner look alive nor stops a reaper.
#pragma once

#include <string>

#include <mpf/file_descriptor.h>

#include "shm/layout.h"

namespace mpf::owner_lock {

// Places the owner's lock. The kernel keeps it until all descriptors of this open file are closed.
[[nodiscard]] bool trySet(int fd) noexcept;
// Whether any process holds a write lock on the byte of the owner's lock. Returns true also on an
// error, because an error does not prove that the owner is dead.
[[nodiscard]] bool isHeld(int fd) noexcept;
// As isHeld(), and the process that `header` names has not ended, so it may be the owner.
[[nodiscard]] bool isHeldByOwner(int fd, const layout::SegmentHeader& header) noexcept;

// The right to remove the name of a dead window. Only one process of the host has it at a time.
//
//   write lock on byte 1 granted ─────► has the right, unless the reaper file is locked
//   write lock refused (strangers) ─► lock on the reaper file
//                                     ─► has the right, unless another reaper has locked byte 1
//
// Only the creator's user may open a reaper file, so no stranger can lock it. The file exists only
// while it is needed. Of several processes that try at the same time, one gets the right; only if a
// stranger releases its lock at that moment may all of them give up.
class Reaper {
 public:
  //   file         the window's file, open for writing
  //   reaperFile   name of the reaper file; empty: this window has no reaper file
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

// Removes a reaper file that a killed reaper left. Returns false if another process uses it or this
// user may not remove it.
bool removeReaperFile(const std::string& name);

}  // namespace mpf::owner_lock
