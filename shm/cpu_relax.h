// SPDX-License-Identifier: MIT
// cpuRelax: the processor's pause instruction, for a loop that polls shared memory.
#pragma once

namespace mpf {

inline void cpuRelax() noexcept {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

}  // namespace mpf
