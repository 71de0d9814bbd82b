// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/line_sync.h"

#include <algorithm>
#include <utility>

namespace mpf {
namespace {

std::int64_t nsOf(std::chrono::nanoseconds time) noexcept { return time.count(); }

}  // namespace

void LineSync::asked(std::string eom, std::size_t maxBytes) {
  late_ = Late{.eom = std::move(eom), .maxBytes = maxBytes, .last = {}};
  wasAsked_ = true;
  hasSurplus_ = false;
}

void LineSync::answered() noexcept { late_.reset(); }

void LineSync::unanswered(std::int64_t nowNs) noexcept {
  if (late_ && late_->sinceNs == 0) late_->sinceNs = nowNs;
}

void LineSync::written(std::int64_t nowNs) noexcept {
  late_.reset();
  wasAsked_ = false;
  activeNs_ = nowNs;
}

void LineSync::received(std::uint8_t byte, std::int64_t nowNs) {
  activeNs_ = nowNs;
  if (!late_) return;
  auto& late = *late_;
  ++late.bytes;
  late.last += static_cast<char>(byte);
  if (late.last.size() > late.eom.size()) late.last.erase(0, 1);
  const bool isEnd = !late.eom.empty() && late.last == late.eom;
  const bool isFull = late.maxBytes != 0 && late.bytes >= late.maxBytes;
  const bool isEndless = late.eom.empty() && late.maxBytes == 0;
  late.isWhole = late.isWhole || isEnd || isFull || isEndless;
}

std::int64_t LineSync::readyAtNs(bool isQuestion) const noexcept {
  const bool isOutOfStep = late_ || hasSurplus_;
  if (!isQuestion && !isOutOfStep) return 0;
  const auto silentAtNs = activeNs_ + nsOf(isOutOfStep ? limits_.quietTime : limits_.settleTime);
  if (isWhole()) return silentAtNs;
  return std::max(silentAtNs, late_->sinceNs + nsOf(limits_.resyncLimit));
}

}  // namespace mpf
