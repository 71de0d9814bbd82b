// SPDX-License-Identifier: MIT
#include "shm/fan_out_loans.h"

#include <algorithm>
#include <new>

#include "base/step.h"

namespace mpf {
namespace {

constexpr std::size_t kMaxMissed = 1024;  // requests of one client; the oldest is forgotten

}  // namespace

bool FanOutLoans::tryLend(const std::shared_ptr<FanOutChunk>& chunk) noexcept try {
  held_.push_back(chunk);
  chunk->hold();
  MPF_STEP(fan_out_lent);
  return true;
} catch (const std::bad_alloc&) {
  return false;
}

void FanOutLoans::takeBack(std::uint32_t number) noexcept {
  const auto loan = std::ranges::find(held_, number, &FanOutChunk::number);
  if (loan == held_.end()) return;
  (*loan)->drop();
  held_.erase(loan);
  MPF_STEP(fan_out_collected);
}

void FanOutLoans::endAll() noexcept {
  for (const auto& chunk : held_) chunk->drop();
  held_.clear();
}

void FanOutLoans::retireAll() noexcept {
  for (const auto& chunk : held_) chunk->retire();
  endAll();
}

void FanOutLoans::noteMissed(std::uint32_t requestId) noexcept try {
  const auto known = std::ranges::find(missed_, requestId, &Missed::requestId);
  if (known != missed_.end()) {
    if (known->count != UINT32_MAX) ++known->count;
    return;
  }
  if (missed_.size() == kMaxMissed) missed_.erase(missed_.begin());
  missed_.push_back({requestId, 1});
  // NOLINTNEXTLINE(bugprone-empty-catch): the client is told too small a number
} catch (const std::bad_alloc&) {
}

std::uint32_t FanOutLoans::missed(std::uint32_t requestId) const noexcept {
  const auto known = std::ranges::find(missed_, requestId, &Missed::requestId);
  return known == missed_.end() ? 0 : known->count;
}

void FanOutLoans::forgetMissed(std::uint32_t requestId) noexcept {
  std::erase_if(missed_, [requestId](const Missed& one) { return one.requestId == requestId; });
}

}  // namespace mpf
