// SPDX-License-Identifier: MIT
#include "pulse_counter_model.h"

void PulseCounterModel::pulse(int channel) {
  const std::lock_guard lock(mutex_);
  ++counts_.at(static_cast<std::size_t>(channel));
}

std::uint16_t PulseCounterModel::read(Space space, std::size_t offset, Lanes /*lanes*/) {
  const std::lock_guard lock(mutex_);
  const auto channel = offset / 4;
  if (space != Space::io || channel >= counts_.size()) return 0xffff;
  if (offset % 4 != 0) return latch_;
  latch_ = static_cast<std::uint16_t>(counts_[channel]);
  return static_cast<std::uint16_t>(counts_[channel] >> 16);
}

void PulseCounterModel::write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) {
  const std::lock_guard lock(mutex_);
  if (space != Space::io || offset != PulseCounter::kClear) return;
  for (std::size_t channel = 0; channel < counts_.size(); ++channel) {
    if ((value & lanes & (1U << channel)) != 0) counts_[channel] = 0;
  }
}
