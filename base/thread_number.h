// SPDX-License-Identifier: MIT
// threadNumber(): identifies a thread of this process. Unlike a thread id or an address of
// thread-local data, no later thread gets the number of a thread that has ended.
//
// Threads  any.
#pragma once

#include <atomic>
#include <cstdint>

namespace mpf {

namespace detail {
// With this model, reading the number is no function call, in shared libraries either. It takes 8
// bytes of the static thread-local memory that a process keeps for libraries that it loads late.
[[gnu::tls_model("initial-exec")]] inline constinit thread_local std::uint64_t ownThreadNumber = 0;
}  // namespace detail

// An even number that no other thread of this process has or had; never 0.
inline std::uint64_t threadNumber() noexcept {
  static constinit std::atomic<std::uint64_t> last{0};
  auto& number = detail::ownThreadNumber;
  if (number == 0) number = last.fetch_add(2, std::memory_order_relaxed) + 2;
  return number;
}
// The number of no thread.
inline constexpr std::uint64_t kNoThread = 1;
// As threadNumber(), but 0 if this thread has not asked for its number yet.
inline std::uint64_t threadNumberOrZero() noexcept { return detail::ownThreadNumber; }

}  // namespace mpf
