// SPDX-License-Identifier: MIT
// Private pages: the copies that this process has of pages of a mapping with
// Mapping::Access::copyOnWrite: it has written to them, or locked them in memory (mlockall()). Such
// a page no longer shows what the owner of the file writes.
//
// Threads  any; no other thread uses the range.
// Crash    changes only the mappings of this process.
// Trust    reads nothing that another process wrote.
#pragma once

#include <cstddef>

namespace mpf::private_pages {

// Drops the copies in a range, so that it shows the file again. Pages that were locked in memory
// are not locked afterwards. `data` is the start of a page.
void drop(std::byte* data, std::size_t bytes) noexcept;

// Whether the range has such a copy. True if it cannot be determined, for example without /proc.
[[nodiscard]] bool mayExist(const std::byte* data, std::size_t bytes) noexcept;

}  // namespace mpf::private_pages
