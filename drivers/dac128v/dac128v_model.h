// SPDX-License-Identifier: MIT
// Dac128vModel: a Systran DAC128V that is not there.
//
//   Dac128vModel model({.onVolts = [](int channel, double volts) { ... }});
//
// Threads  as DeviceModel.
#pragma once

#include <array>
#include <functional>
#include <mutex>

#include <mpf/drivers/dac128v/dac128v.h>
#include <mpf/drivers/industry_pack/device_model.h>

namespace mpf {

class Dac128vModel final : public DeviceModel {
 public:
  // Told of what an output gives: of each channel at power-up, and then at each write, in their order. It must not touch the model.
  using OnVolts = std::function<void(int channel, double volts)>;

  explicit Dac128vModel(const Dac128vRanges& ranges = {}, OnVolts onVolts = {});

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

  // What an output gives now.
  [[nodiscard]] double volts(int channel) const;
  // Bits of a channel's register that are stuck at 0: a fault.
  void setStuck(int channel, std::uint16_t bits);

 private:
  [[nodiscard]] double voltsOf(std::size_t channel) const;

  Dac128vRanges ranges_;
  OnVolts onVolts_;
  mutable std::mutex mutex_;
  std::array<std::uint16_t, Dac128v::kChannels> codes_{};
  std::array<std::uint16_t, Dac128v::kChannels> stuck_{};
};

}  // namespace mpf
