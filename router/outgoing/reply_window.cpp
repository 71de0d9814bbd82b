// SPDX-License-Identifier: MIT
#include "router/outgoing/reply_window.h"

#include <algorithm>
#include <utility>

namespace mpf::router {

std::uint32_t ReplyWindow::taken(std::uint64_t bytes) noexcept {
  constexpr std::uint32_t kCreditShare = 4;
  taken_ += static_cast<std::uint32_t>(bytes);
  if (taken_ < bytes_ / kCreditShare) return 0;
  uncredited_ -= std::min<std::uint64_t>(taken_, uncredited_);
  return std::exchange(taken_, 0);
}

}  // namespace mpf::router
