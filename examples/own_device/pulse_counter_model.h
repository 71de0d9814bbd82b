// SPDX-License-Identifier: MIT
// PulseCounterModel: device model of the module that PulseCounter drives.
//
//   auto& model = carrier.plug("IP_a", std::make_unique<PulseCounterModel>());
//   model.pulse(2);
//
// Threads  any.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>

#include <mpf/drivers/industry_pack/device_model.h>

#include "pulse_counter.h"

class PulseCounterModel : public mpf::DeviceModel {
 public:
  PulseCounterModel()
      : DeviceModel({.manufacturer = PulseCounter::kManufacturer, .model = PulseCounter::kModel}) {}

  // A pulse arrives at an input, 0 to 7.
  void pulse(int channel);

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

 private:
  std::mutex mutex_;
  std::array<std::uint32_t, PulseCounter::kChannels> counts_{};
  std::uint16_t latch_ = 0;  // low half of the count whose high half was read last
};
