// SPDX-License-Identifier: MIT
// Bias: lets the thread that uses a lock most of the time enter without a locked instruction. The
// other threads use the real lock, and first disable the bias.
//
//   disabled ── noteEntry(), kEntries in a row by one thread ──► enabled, for this thread
//            ◄── disable(), by another thread ─────────────────
//
//   the owner        inside = 1 ───────────────────────────── still enabled? else inside = 0
//   another thread   enabled = 0 ─ barrier in all threads ─── inside?
//
// The barrier ensures that the owner sees that the bias is disabled, or that the other thread sees
// that the owner is inside.
//
// Threads  tryEnter(), leave(), isMine(): any. The rest: the holder of the real lock.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

#include "base/expedited_barrier.h"
#include "base/thread_number.h"

namespace mpf {

class Bias {
 public:
  // True when the bias is enabled for the calling thread, which is inside until leave().
  [[nodiscard, gnu::always_inline]] bool tryEnter() noexcept {
    const auto me = threadNumberOrZero();
    // PAIR(bias-disabled): sees what the other thread did before it disabled the bias.
    if (enabledFor_.load(std::memory_order_acquire) != me) return false;
    isInside_.store(true, std::memory_order_relaxed);
    expedited_barrier::frequentSide();
    if (enabledFor_.load(std::memory_order_relaxed) == me) return true;
    leave();
    return false;
  }
  void leave() noexcept {
    // PAIR(bias): a thread that sees us outside sees what we did inside.
    isInside_.store(false, std::memory_order_release);
  }
  // Whether the calling thread is inside.
  [[nodiscard, gnu::always_inline]] bool isMine() const noexcept {
    return isOwner() && isInside_.load(std::memory_order_relaxed);
  }

  // Counts an entry of the calling thread by the real lock. The bias becomes enabled, at once or
  // later, for the first thread that enters kEntries times in a row.
  void noteEntry() noexcept {
    const auto me = threadNumber();
    if (std::exchange(lastThread_, me) != me) entries_ = 0;
    if (++entries_ % kEntries != 0 || !mayEnable()) return;
    owner_.store(me, std::memory_order_relaxed);
    enabledFor_.store(me, std::memory_order_relaxed);
  }
  [[nodiscard]] bool isOfAnotherThread() const noexcept { return isEnabled() && !isOwner(); }
  // Disables the bias, unless the calling thread is its owner. Returns false when the owner is
  // inside: then the caller waits until isInside() is false, or gives up.
  [[nodiscard]] bool disable() noexcept {
    if (isOwner()) return true;
    if (isEnabled()) {
      // PAIR(bias-disabled): the owner uses the real lock from now on.
      enabledFor_.store(kNoThread, std::memory_order_release);
      expedited_barrier::inThisProcess();
    }
    return !isInside();
  }
  [[nodiscard]] bool isInside() const noexcept {
    // PAIR(bias): sees what the owner did inside.
    return isInside_.load(std::memory_order_acquire);
  }

 private:
  static constexpr std::uint32_t kEntries = 256;

  [[nodiscard]] bool isEnabled() const noexcept {
    return enabledFor_.load(std::memory_order_relaxed) != kNoThread;
  }
  [[nodiscard]] bool isOwner() const noexcept {
    return owner_.load(std::memory_order_relaxed) == threadNumberOrZero();
  }
  // isInside_ has one writer, so no second thread becomes the owner.
  [[nodiscard]] bool mayEnable() const noexcept {
    return (owner_.load(std::memory_order_relaxed) == kNoThread || isOwner()) &&
           expedited_barrier::tryRegister();
  }

  std::atomic<std::uint64_t> enabledFor_{kNoThread};  // the owner; kNoThread: disabled
  std::atomic<bool> isInside_{false};  // written by the owner
  std::atomic<std::uint64_t> owner_{kNoThread};  // written once
  std::uint64_t lastThread_ = 0;  // of the last entry by the real lock
  std::uint32_t entries_ = 0;  // of that thread in a row
};

}  // namespace mpf
