// SPDX-License-Identifier: MIT
// Fault guard: keeps mapped memory readable when a peer truncates the file. Without it, the next
// access would raise SIGBUS and the kernel would kill the process.
//
//   access beyond the end of the file ─► SIGBUS ─► handler:
//     in a guarded mapping whose file can be grown   grow the file, repeat the access
//     in another guarded mapping                     map zeroes in its place; lossOf() is now true
//     elsewhere                                      call the handler that was installed before
//
// In the child of a fork, all guarded mappings are replaced by zeroes, and the child gives up its
// copies of the parent's locks: see fork_guard.h.
//
// Threads  any; the thread that causes a fault repairs it. If this thread blocks SIGBUS, the kernel
//          kills the process without calling the handler.
// Crash    uses no shared state.
// Trust    a peer may truncate a file at any time and any number of times.
#pragma once

#include <signal.h>

#include <atomic>
#include <cstddef>
#include <string>

namespace mpf::fault_guard {

struct Range;

// Guards a mapping from now on. The first call installs the handler of SIGBUS.
//   throws  std::bad_alloc, std::system_error
Range* add(void* data, std::size_t bytes, bool writable);
// Ends the guard. Call it before the memory is unmapped.
void remove(Range* range) noexcept;
// Makes the guard grow a truncated file again: by a descriptor, which must stay open as long as the
// range is guarded, or by the path of the file. For files that more than two processes share. The
// part that was cut off contains zeroes afterwards.
void growBy(Range& range, int file) noexcept;
void growAt(Range& range, int file, const std::string& path) noexcept;
// True once the file was truncated and could not be grown: the memory is then private zeroes. A
// reference, so that each message with a large body reads it without a call. It says nothing after
// remove().
[[nodiscard]] const std::atomic<bool>& lossOf(const Range& range) noexcept;

// For a program that installs its own SIGBUS handler after its first MPF object. Returns true if
// the fault was in a guarded range and is repaired: the handler returns. Async-signal-safe.
bool tryRepair(const siginfo_t& fault) noexcept;

}  // namespace mpf::fault_guard
