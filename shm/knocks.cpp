// SPDX-License-Identifier: MIT
#include "shm/knocks.h"

#include "base/step.h"

namespace mpf {

std::optional<std::uint64_t> Knocks::tryTake() noexcept {
  // PAIR(knocked): read before the knocks that it counts.
  const auto knocked = hints_.knocked.load(std::memory_order_acquire);
  if (knocked != knockedSeen_) {
    knockedSeen_ = knocked;
    place_ = 0;
  }
  for (; place_ < layout::kKnocks; ++place_) {
    auto& knock = hints_.knocks[place_];
    if (knock.load(std::memory_order_relaxed) == 0) continue;
    // PAIR(knock): the link already has its name.
    if (const auto incarnation = knock.exchange(0, std::memory_order_acq_rel); incarnation != 0) {
      MPF_STEP(knock_taken);
      return incarnation;
    }
  }
  return std::nullopt;
}

bool Knocks::takeRescan() noexcept {
  return hints_.rescan.load(std::memory_order_relaxed) != 0 &&
         hints_.rescan.exchange(0, std::memory_order_relaxed) != 0;
}

}  // namespace mpf
