// SPDX-License-Identifier: MIT
#include "router/polled.h"

#include <algorithm>
#include <kj/common.h>

namespace mpf::router {

void PolledSet::add(Polled& polled) {
  if (isReplacing_) return;
  if (!all_.empty() && all_.back() == &polled) return;
  if (const auto found = std::ranges::find(all_, &polled); found != all_.end()) {
    std::rotate(found, found + 1, all_.end());
    return;
  }
  if (all_.size() == kMax) {
    isReplacing_ = true;
    KJ_DEFER(isReplacing_ = false);
    dropFirst();
  }
  all_.push_back(&polled);
  polled.setPolled(true);
}

void PolledSet::remove(Polled& polled) noexcept {
  std::erase(all_, &polled);
  std::ranges::replace(round_, &polled, nullptr);
}

void PolledSet::poll() {
  round_ = all_;
  KJ_DEFER(round_.clear());
  for (auto& polled : round_)
    if (polled != nullptr) polled->poll();
}

void PolledSet::clear() {
  for (auto left = all_.size(); left != 0 && !all_.empty(); --left) dropFirst();
}

void PolledSet::dropFirst() {
  auto& first = *all_.front();
  remove(first);
  first.setPolled(false);
  first.poll();
}

}  // namespace mpf::router
