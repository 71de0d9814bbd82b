// SPDX-License-Identifier: MIT
// prefetchForWriting(): asks for a cache line that this processor will write soon.
#pragma once

namespace mpf {

inline void prefetchForWriting(const void* address) noexcept {
#ifdef __x86_64__
  // __builtin_prefetch() emits this instruction only for newer processors; older ones ignore it.
  __asm__ __volatile__("prefetchw %0" : : "m"(*static_cast<const char*>(address)));
#else
  __builtin_prefetch(address, 1);
#endif
}

}  // namespace mpf
