// SPDX-License-Identifier: MIT
// lines: fetches cache lines for this processor before it writes to them, and moves written lines
// to the shared cache.
//
// A line that another processor has read must come back before a write to it takes effect.
// prefetchw fetches it without waiting (Intel processors before Broadwell ignore it). On Zen 3 this
// takes longer than a message, so it helps only far ahead; on Zen 4 it has hardly any effect. On
// both, only a write fetches the line in time.
//
// Threads  request(), offer(): any; claim(): the thread that may write the field.
#pragma once

#include <sched.h>

#include <cstdint>

namespace mpf::lines {

// Fetches the line at `address` for writing.
inline void request(const void* address) noexcept {
#if defined(__x86_64__)
  asm volatile("prefetchw %0" : : "m"(*static_cast<const char*>(address)));
#else
  __builtin_prefetch(address, 1);
#endif
}

// Fetches the line of a field that is written soon. Its value may be lost.
template <class T>
void claim(T& field) noexcept {
#if defined(__x86_64__)
  if (__builtin_cpu_is("intel")) return request(&field);
#endif
  volatile T& mine = field;
  mine = T{};  // without a read, which would fetch the line once more
}

// Moves the line at `address` from this processor to the cache that all processors share, from
// where another one gets it sooner. A processor without cldemote executes it as a NOP.
inline void offer(const void* address) noexcept {
#if defined(__x86_64__)
  asm volatile("cldemote %0" : : "m"(*static_cast<const char*>(address)));
#else
  static_cast<void>(address);
#endif
}

// 1 + the number of the processor of this thread, which may change at any time; 0: unknown.
[[nodiscard]] inline std::uint32_t thisProcessor() noexcept {
  return static_cast<std::uint32_t>(sched_getcpu()) + 1;
}

}  // namespace mpf::lines
