// SPDX-License-Identifier: MIT
// PlainModel: device model with 16-bit words that keep what is written. Bit 0 of word 0 drives an
// interrupt request line.
#pragma once

#include <array>
#include <memory>

#include <mpf/drivers/industry_pack/model_carrier.h>

namespace mpf::test {

class PlainModel final : public DeviceModel {
 public:
  explicit PlainModel(IdProm id = {.manufacturer = 0xa3, .model = 0x11}) : DeviceModel(id) {}

  std::uint16_t read(Space /*space*/, std::size_t offset, Lanes /*lanes*/) override {
    const std::lock_guard lock(mutex_);
    return words_.at(offset / 2);
  }
  void write(Space /*space*/, std::size_t offset, std::uint16_t value, Lanes lanes) override {
    const std::lock_guard lock(mutex_);
    auto& word = words_.at(offset / 2);
    word = static_cast<std::uint16_t>((word & ~lanes) | (value & lanes));
    if (offset == 0) setInterrupt(0, (word & 1) != 0);
  }

 private:
  std::mutex mutex_;
  std::array<std::uint16_t, 64> words_{};
};

}  // namespace mpf::test
