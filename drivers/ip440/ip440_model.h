// SPDX-License-Identifier: MIT
// Ip440Model: an Acromag IP440 that is not there, in its standard mode.
//
//   auto& model = carrier.plug("IP_c", std::make_unique<Ip440Model>());
//   model.setInputs(0x80000001);
//   model.connect(3, [wire] { return wire.get(); });   // IN03 is on above kOnVolts
//
// Threads  as DeviceModel.
#pragma once

#include <array>
#include <functional>
#include <mutex>

#include <mpf/drivers/industry_pack/device_model.h>
#include <mpf/drivers/ip440/ip440.h>

namespace mpf {

class Ip440Model final : public DeviceModel {
 public:
  // What is on an input that is connected.
  using Volts = std::function<double()>;
  static constexpr double kOnVolts = 2.5;  // of this model; a real one has what its version says

  explicit Ip440Model(std::uint32_t inputs = 0) : DeviceModel({.manufacturer = kAcromag, .model = Ip440::kModel}), inputs_(inputs) {}

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  // The ports must not be written to, the rest is for modes that this model does not have.
  void write(Space /*space*/, std::size_t /*offset*/, std::uint16_t /*value*/, Lanes /*lanes*/) override {}

  // What is on those that are not connected; bit 0 is IN00, 1 is on.
  void setInputs(std::uint32_t bits);
  //   throws  std::out_of_range unless input is 0 to 31
  void connect(int input, Volts volts);

 private:
  [[nodiscard]] bool isOn(std::size_t input) const;

  std::mutex mutex_;
  std::uint32_t inputs_;
  std::array<Volts, Ip440::kInputs> outside_;
};

}  // namespace mpf
