// SPDX-License-Identifier: MIT
// Two processes that take turns: each waits until a word in shared memory has its next value.
// What a process wrote before post() is visible to the other after wait().
//
//   Spinning  looks at the word all the time
//   Asleep    sleeps in the kernel (futex) until the word changes; only its post() wakes a sleeper
//
// The values go up by one.
#pragma once

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>

#include "benchmarks/stage/stage.h"
#include "shm/cpu_relax.h"

namespace mpf::bench {

using Word = std::atomic<std::uint32_t>;

struct alignas(kLineBytes) Line {
  Word word{0};
};

// Two lines, one for each direction.
struct Bounce {
  Line request;
  Line reply;
};

struct Spinning {
  static void post(Word& word, std::uint32_t value) noexcept {
    // PAIR(bench-bounce): a process that sees the value sees everything written before it.
    word.store(value, std::memory_order_release);
  }
  [[nodiscard]] static bool has(const Word& word, std::uint32_t value) noexcept {
    // PAIR(bench-bounce): see post().
    return word.load(std::memory_order_acquire) == value;
  }
  static void wait(const Word& word, std::uint32_t value) noexcept {
    while (!has(word, value)) cpuRelax();
  }
};

struct Asleep {
  static void post(Word& word, std::uint32_t value) noexcept {
    Spinning::post(word, value);
    ::syscall(SYS_futex, &word, FUTEX_WAKE, 1, nullptr, nullptr, 0);
  }
  static void wait(const Word& word, std::uint32_t value) noexcept {
    while (!Spinning::has(word, value))
      ::syscall(SYS_futex, &word, FUTEX_WAIT, value - 1, nullptr, nullptr, 0);
  }
};

}  // namespace mpf::bench
