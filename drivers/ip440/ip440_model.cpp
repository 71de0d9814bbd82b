// SPDX-License-Identifier: MIT
#include "drivers/ip440/ip440_model.h"

#include <utility>

namespace mpf {
namespace {

constexpr std::size_t kBytesOfPorts = 8;
// the upper half of the data bus; the carrier pulls it up
constexpr std::uint16_t kNotDriven = 0xff00;

}  // namespace

std::uint16_t Ip440Model::read(Space space, std::size_t offset, Lanes /*lanes*/) {
  const std::lock_guard lock(mutex_);
  std::uint16_t word = kNotDriven;
  if (space != Space::io || offset >= kBytesOfPorts) return word;
  for (std::size_t bit = 0; bit < 8; ++bit) {
    if (isOn(offset / 2 * 8 + bit)) word = static_cast<std::uint16_t>(word | (1U << bit));
  }
  return word;
}

void Ip440Model::setInputs(std::uint32_t bits) {
  const std::lock_guard lock(mutex_);
  inputs_ = bits;
}

void Ip440Model::connect(int input, Volts volts) {
  const std::lock_guard lock(mutex_);
  outside_.at(static_cast<std::size_t>(input)) = std::move(volts);
}

bool Ip440Model::isOn(std::size_t input) const {
  const auto& volts = outside_.at(input);
  return volts ? volts() > kOnVolts : ((inputs_ >> input) & 1) != 0;
}

}  // namespace mpf
