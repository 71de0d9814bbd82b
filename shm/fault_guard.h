// SPDX-License-Identifier: MIT
// Fault guard: what a process has mapped stays readable when a peer cuts the file under it. Without
// it the kernel would send SIGBUS and the process would be dead.
//
//   access behind the end of the file ─► SIGBUS ─► ours, and may be grown again: grow it, go on
//                                                 ours: zeroes in place of the whole mapping, which
//                                                 isLost() from now on not ours: the handler that
//                                                 was there before
//
// The child of a fork gets zeroes in place of everything that its parent has mapped, and none of
// its parent's locks: see origin.h.
//
// Threads  any; a fault is repaired in the thread that met it. A thread that blocks SIGBUS is
//          killed by the kernel before we are asked.
// Crash    nothing of this is shared.
// Trust    a peer may cut a file at any time, as often as it likes.
#pragma once

#include <signal.h>

#include <cstddef>
#include <string>

namespace mpf::fault_guard {

struct Range;

// Guards a mapping from now on. The first call installs the handler of SIGBUS.
//   throws  std::bad_alloc, std::system_error
Range* add(void* data, std::size_t bytes, bool writable);
// Before the memory is unmapped.
void remove(Range* range) noexcept;
// When the file is cut, it is grown again: by a descriptor that stays open as long as the range is
// guarded, or by its name. For what more than two processes share; all that was in it is zero
// afterwards.
void growBy(Range& range, int file) noexcept;
void growAt(Range& range, int file, const std::string& path) noexcept;
// Whether its file was cut and could not be grown: the memory is ours alone.
[[nodiscard]] bool isLost(const Range& range) noexcept;

// For the SIGBUS handler of a program that installs one after its first MPF object. True: it was
// ours, return from the handler. Async-signal-safe.
bool tryRepair(const siginfo_t& fault) noexcept;

}  // namespace mpf::fault_guard
