// SPDX-License-Identifier: MIT
// BiasedLock: a SpinLock that costs a thread no locked instruction as long as this thread alone
// uses it.
//
// Threads  any. As for SpinLock: held for a few tens of instructions, and not in shared memory.
#pragma once

#include "base/bias.h"
#include "base/spin_lock.h"

namespace mpf {

class BiasedLock {
 public:
  void lock() noexcept {
    if (!bias_.tryEnter()) lockReal();
  }
  [[gnu::always_inline]] void unlock() noexcept {
    if (bias_.isMine()) bias_.leave();
    else real_.unlock();
  }

 private:
  // Not inline, so that lock() is.
  [[gnu::noinline]] void lockReal() noexcept {
    real_.lock();
    if (!bias_.disable()) SpinLock::waitUntil([this] { return !bias_.isInside(); });
    bias_.noteEntry();
  }

  Bias bias_;
  SpinLock real_;
};

}  // namespace mpf
