// SPDX-License-Identifier: MIT
// Ip440Model: device model of an Acromag IP440 in its standard mode.
//
//   auto& model = carrier.plug("IP_c", std::make_unique<Ip440Model>());
//   model.setInputs(0x80000001);
//   model.connect(3, [wire] { return wire.get(); });   // IN03 is on above kOnVolts
//
// Threads  as DeviceModel; setInputs() and connect() may be called by any thread.
#pragma once

#include <array>
#include <functional>
#include <mutex>

#include <mpf/drivers/industry_pack/device_model.h>

#include "drivers/ip440/ip440.h"

namespace mpf {

class Ip440Model final : public DeviceModel {
 public:
  // Returns the voltage [V] at a connected input.
  using Volts = std::function<double()>;
  // of this model; the threshold of a real module depends on its version
  static constexpr double kOnVolts = 2.5;

  explicit Ip440Model(std::uint32_t inputs = 0)
      : DeviceModel({.manufacturer = kAcromag, .model = Ip440::kModel}), inputs_(inputs) {}

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  // Writes have no effect: the inputs are read-only, and the model has no other mode.
  void write(Space /*space*/, std::size_t /*offset*/, std::uint16_t /*value*/,
             Lanes /*lanes*/) override {}

  // Sets the inputs that no wire drives; bit 0 is IN00, 1 is on.
  void setInputs(std::uint32_t bits);
  // From now on, input number `input` is on while volts() is above kOnVolts.
  //
  //   volts     called at each read, with the model locked
  //   throws    std::out_of_range unless input is 0 to 31
  void connect(int input, Volts volts);

 private:
  [[nodiscard]] bool isOn(std::size_t input) const;

  std::mutex mutex_;
  std::uint32_t inputs_;
  std::array<Volts, Ip440::kInputs> outside_;
};

}  // namespace mpf
