// SPDX-License-Identifier: MIT
#include "drivers/dac128v/dac128v_model.h"

#include <utility>

namespace mpf {
namespace {

// bits that the module does not drive; the carrier pulls them up
constexpr std::uint16_t kNotKept = 0xf000;

}  // namespace

Dac128vModel::Dac128vModel(const Dac128vRanges& ranges, OnVolts onVolts)
    : DeviceModel({.manufacturer = kSystran, .model = 0x69, .revision = 0x10}),
      ranges_(ranges),
      onVolts_(std::move(onVolts)) {
  codes_.fill(Dac128v::kPowerUpCode);
  for (std::size_t channel = 0; onVolts_ && channel < codes_.size(); ++channel)
    onVolts_(static_cast<int>(channel), voltsOf(channel));
}

std::uint16_t Dac128vModel::read(Space space, std::size_t offset, Lanes /*lanes*/) {
  const std::lock_guard lock(mutex_);
  const auto channel = offset / 2;
  return space == Space::io && channel < codes_.size()
             ? static_cast<std::uint16_t>(codes_[channel] | kNotKept)
             : 0;
}

void Dac128vModel::write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) {
  const std::lock_guard lock(mutex_);
  const auto channel = offset / 2;
  if (space != Space::io || channel >= codes_.size()) return;
  const auto merged = (codes_[channel] & ~lanes) | (value & lanes);
  codes_[channel] = static_cast<std::uint16_t>(merged & Dac128v::kMaxCode & ~stuck_[channel]);
  if (onVolts_) onVolts_(static_cast<int>(channel), voltsOf(channel));
}

double Dac128vModel::volts(int channel) const {
  const std::lock_guard lock(mutex_);
  return voltsOf(static_cast<std::size_t>(channel));
}

void Dac128vModel::setStuck(int channel, std::uint16_t bits) {
  const std::lock_guard lock(mutex_);
  stuck_.at(static_cast<std::size_t>(channel)) = bits;
}

double Dac128vModel::voltsOf(std::size_t channel) const {
  return ranges_.at(channel / Dac128v::kChannelsInGroup).voltsOf(codes_.at(channel));
}

}  // namespace mpf
