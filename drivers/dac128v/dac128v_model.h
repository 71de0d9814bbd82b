// SPDX-License-Identifier: MIT
// Dac128vModel: device model of a Systran DAC128V.
//
//   Dac128vModel model({}, [](int channel, double volts) { ... });
//
// Threads  as DeviceModel.
#pragma once

#include <array>
#include <functional>
#include <mutex>

#include <mpf/drivers/dac128v.h>
#include <mpf/drivers/industry_pack/device_model.h>

namespace mpf {

class Dac128vModel final : public DeviceModel {
 public:
  // Called with the voltage of an output: for each channel at power-up, then at each write, in
  // order. The model is locked during the call, so the function must not call it.
  using OnVolts = std::function<void(int channel, double volts)>;

  explicit Dac128vModel(const Dac128vRanges& ranges = {}, OnVolts onVolts = {});

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

  // Returns the voltage [V] of an output. `channel` is 0 to 7.
  [[nodiscard]] double volts(int channel) const;
  // Simulates a fault: these bits of the channel's register are stuck at 0.
  //   throws  std::out_of_range unless channel is 0 to 7
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
