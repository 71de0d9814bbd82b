// SPDX-License-Identifier: MIT
// Process: who this process is and whether another one is still the one it was.
#pragma once

#include <cstdint>
#include <string>

#include <mpf/file_descriptor.h>

#include "shm/layout.h"

namespace mpf {

struct Process {
  std::int32_t pid{};
  std::uint32_t uid{};
  std::uint64_t startTicks{};    // since boot; with the pid it names a process for good
  std::uint64_t pidNamespace{};  // inode
  std::string program;

  // Read once, and again after a fork.
  static Process self();
  void describe(layout::SegmentHeader& header) const;

  // A descriptor that becomes readable when the owner in `header` ends; empty when it cannot be
  // told from here (gone already, another pid namespace, a pid that somebody else has now).
  static FileDescriptor openOwner(const layout::SegmentHeader& header);
  // Whether the owner in `header` is known to have ended. False also when this process cannot
  // tell: the header names no process, or one of another pid namespace, or /proc does not show it.
  static bool hasEnded(const layout::SegmentHeader& header) noexcept;
};

}  // namespace mpf
