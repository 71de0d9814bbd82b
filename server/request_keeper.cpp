// SPDX-License-Identifier: MIT
#include "server/request_keeper.h"

#include <atomic>

#include "server/reply_sender.h"

namespace mpf {

// No lock: another thread might hold it when this process forks.
RequestKeeper& RequestKeeper::make(ReplySender& replies) {
  static std::atomic<RequestKeeper*> newest{nullptr};
  auto* const keeper = new RequestKeeper(replies);
  keeper->older_ = newest.load(std::memory_order_relaxed);
  while (!newest.compare_exchange_weak(keeper->older_, keeper, std::memory_order_relaxed)) {
  }
  return *keeper;
}

void RequestKeeper::leave() noexcept {
  if (forkGuard_.isInherited()) return;
  const std::lock_guard lock(mutex_);
  replies_ = nullptr;
}

void RequestKeeper::abandoned(const Route& route) noexcept {
  if (forkGuard_.isInherited()) return;
  const std::lock_guard lock(mutex_);
  if (replies_ != nullptr) replies_->refuseAbandoned(route);
}

}  // namespace mpf
