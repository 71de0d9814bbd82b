// SPDX-License-Identifier: MIT
// lines: brings cache lines to this processor before it writes to them. It changes no data.
//
// A line that another processor has read must come back before a write to it takes effect. An Intel
// processor fetches it with prefetchw, without waiting. An AMD processor (Zen 3) takes no line with
// prefetchw that others read; there only a write brings it back.
#pragma once

namespace mpf::lines {

// Fetches the line at `address` for writing, if the processor can do this without a write.
inline void request(const void* address) noexcept {
#if defined(__x86_64__)
  asm volatile("prefetchw %0" : : "m"(*static_cast<const char*>(address)));
#else
  __builtin_prefetch(address, 1);
#endif
}

// Whether request() also fetches lines that other processors have read.
[[nodiscard]] inline bool requestsReadLines() noexcept {
#if defined(__x86_64__)
  return __builtin_cpu_is("intel") != 0;
#else
  return false;
#endif
}

// Fetches the line of a field for writing. Only for the thread that may write the field: where
// request() has no effect, this writes what is there already.
template <class T>
void claim(T& field) noexcept {
  if (requestsReadLines()) return request(&field);
  volatile T& same = field;
  same = same;
}

}  // namespace mpf::lines
