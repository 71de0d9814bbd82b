// SPDX-License-Identifier: MIT
#include "server/request_keeper.h"

#include <list>
#include <mutex>

#include "server/reply_sender.h"

namespace mpf {
namespace {

std::mutex& mutex() {
  static auto* const theMutex = new std::mutex;
  return *theMutex;
}

std::list<RequestKeeper>& all() {
  static auto* const keepers = new std::list<RequestKeeper>;
  return *keepers;
}

}  // namespace

RequestKeeper& RequestKeeper::make(ReplySender& replies) {
  const std::lock_guard lock(mutex());
  auto& keeper = all().emplace_back();
  keeper.replies_ = &replies;
  return keeper;
}

void RequestKeeper::leave() noexcept {
  const std::lock_guard lock(mutex());
  replies_ = nullptr;
}

void RequestKeeper::abandoned(const Route& route) noexcept {
  const std::lock_guard lock(mutex());
  if (replies_ != nullptr) replies_->refuseAbandoned(route);
}

}  // namespace mpf
