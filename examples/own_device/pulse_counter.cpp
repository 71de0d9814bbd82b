// SPDX-License-Identifier: MIT
#include "pulse_counter.h"

std::optional<std::uint32_t> PulseCounter::tryRead(int channel) {
  if (!isChannel(channel)) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const auto offset = static_cast<std::size_t>(channel) * 4;
  const std::uint32_t high = module_.io().read16(offset);
  const std::uint32_t count = high << 16 | module_.io().read16(offset + 2);
  if (count == 0xffff'ffff && !module_.problem().empty()) return std::nullopt;
  return count;
}

bool PulseCounter::tryClear(int channel) {
  if (!isChannel(channel)) return false;
  const std::lock_guard lock(mutex_);
  if (!module_.problem().empty()) return false;
  module_.io().write16(kClear, static_cast<std::uint16_t>(1U << channel));
  return true;
}
