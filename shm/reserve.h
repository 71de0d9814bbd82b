// SPDX-License-Identifier: MIT
// reserve: gives the first bytes of a file in /dev/shm memory, so that no access to them fails.
//
// Threads  any thread and signal handler may call: only system calls.
#pragma once

#include <cstddef>

namespace mpf {

// Grows a shorter file. Returns 0 or the error number: ENOSPC if there is not enough free memory.
int reserve(int file, std::size_t bytes) noexcept;

}  // namespace mpf
