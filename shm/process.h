// SPDX-License-Identifier: MIT
// Process: identifies this process in segment headers, and finds out whether the process that a
// header names has ended.
//
// Threads  any.
// Trust    another process may write the header; the answers are about the process that it names.
#pragma once

#include <array>
#include <cstdint>

#include <mpf/file_descriptor.h>

#include "shm/layout.h"

namespace mpf {

struct Process {
  std::int32_t pid{};
  std::uint32_t uid{};
  std::uint64_t startTicks{};    // start time since boot; with the pid it identifies a process
  std::uint64_t pidNamespace{};  // inode
  std::array<char, layout::kProgramChars> program{};  // ends with a null character

  // This process. Each thread reads it once, and again after a fork. The object has no
  // destructor, so static objects may use it while they are destroyed.
  static const Process& self() noexcept;
  // Writes this process into the header as the owner.
  void describe(layout::SegmentHeader& header) const noexcept;

  // A descriptor that becomes readable when the owner in `header` ends. Empty if the owner has
  // ended already, is in another pid namespace, or another process has its pid now.
  static FileDescriptor openOwner(const layout::SegmentHeader& header);
  // Whether the process of a descriptor from openOwner() has ended.
  static bool hasEnded(const FileDescriptor& process) noexcept;
  // Whether it is proven that the owner in `header` has ended. Also false if this process cannot
  // find out: the header names no process, the process is in another pid namespace, or /proc does
  // not show it.
  static bool hasEnded(const layout::SegmentHeader& header) noexcept;
};

}  // namespace mpf
