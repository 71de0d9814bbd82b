// SPDX-License-Identifier: MIT
// BiasedLock: a SpinLock that costs a thread no locked instruction as long as this thread alone
// uses it. A Guard holds it.
//
// Threads  any. As for SpinLock: held for a few tens of instructions, and not in shared memory.
#pragma once

#include "base/bias.h"
#include "base/spin_lock.h"

namespace mpf {

class BiasedLock {
 public:
  // Holds the lock until the end of the scope. Inline, because it is on the path of each message.
  class Guard {
   public:
    [[gnu::always_inline]] explicit Guard(BiasedLock& lock) noexcept
        : lock_(lock), isInside_(lock.bias_.tryEnter()) {
      if (!isInside_) lock.lockReal();
    }
    [[gnu::always_inline]] ~Guard() {
      if (isInside_) lock_.bias_.leave();
      else lock_.real_.unlock();
    }
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;

   private:
    BiasedLock& lock_;
    const bool isInside_;  // has entered by the bias
  };

  // Calls `action` under the lock if the bias is enabled for this thread, which does not hold it.
  template <class Action>
  [[gnu::always_inline]] void ifBiased(const Action& action) noexcept {
    if (!bias_.tryEnter()) return;
    action();
    bias_.leave();
  }

 private:
  // Not inline, so that Guard is.
  [[gnu::noinline]] void lockReal() noexcept {
    real_.lock();
    if (!bias_.disable()) SpinLock::waitUntil([this] { return !bias_.isInside(); });
    bias_.noteEntry();
  }

  Bias bias_;
  SpinLock real_;
};

}  // namespace mpf
