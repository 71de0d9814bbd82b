// SPDX-License-Identifier: MIT
// DigitalIoModel: device model of a module of digital lines.
//
//   DigitalIoModel model(*findDigitalIoKind("IP-Unidig-I"));
//   model.setInputs(0x3, 0x1);                       // bit 0 is high, bit 1 is pulled down
//   model.connect(5, [wire] { return wire.get(); });  // bit 5 follows a wire, in volts
//
//   outputs, enables ─► driver ─┐
//   outside: 5 V, 0 V, a wire ──┴► line ─► comparator ─► inputs ─► edge ─► pending ─► IntReq0*
//
// A line that is not driven is pulled up. The outputs of the DIO316I and of the -HV and -12I12O
// models are not inputs: use OnOutput to see them and connect() to drive inputs.
//
// Threads  as DeviceModel; the other functions may be called by any thread.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <mutex>

#include <mpf/drivers/industry_pack/device_model.h>

#include "drivers/digital_io/digital_io_kind.h"

namespace mpf {

class DigitalIoModel final : public DeviceModel {
 public:
  static constexpr double kHighVolts = 5;
  static constexpr double kTtlThresholdVolts = 1.5;

  // Called with the voltage of an output, at power-up and at each change. The model is locked
  // during the call, so the function must not call it.
  using OnOutput = std::function<void(int bit, double volts)>;
  using Volts = std::function<double()>;

  explicit DigitalIoModel(const DigitalIoKind& kind, OnOutput onOutput = {});

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

  // Drives the lines in `mask` from outside: high where `bits` has a 1, else low.
  void setInputs(std::uint32_t mask, std::uint32_t bits);
  // Drives a line from outside with the voltage that volts() returns; called at each bus cycle and
  // at look().
  void connect(int bit, Volts volts);
  // Reads the connected voltages again; call it when one has changed.
  void look();

  [[nodiscard]] std::uint32_t inputs() const;  // the inputs as a driver would read them
  [[nodiscard]] std::uint32_t outputs() const;  // the output registers
  [[nodiscard]] std::uint32_t driven() const;  // lines that are outputs now
  [[nodiscard]] int vector() const;
  // Simulates a fault: these bits of the output registers are stuck at 0.
  void setStuck(std::uint32_t bits);

 private:
  struct Registers {
    std::uint32_t output = 0xffffffff, outputEnable = 0, interruptEnable = 0, polarity = 0,
                  pending = 0;
    std::uint16_t control = 0, direction = 0, vector = 0, threshold = 0;
  };
  [[nodiscard]] std::uint16_t readWord(std::size_t at) const;
  void writeWord(std::size_t at, std::uint16_t value, Lanes lanes);
  [[nodiscard]] std::uint32_t levels() const;
  [[nodiscard]] std::uint32_t drivenLocked() const;
  [[nodiscard]] double voltsOf(std::size_t bit) const;
  void follow();

  const DigitalIoKind& kind_;
  OnOutput onOutput_;
  mutable std::mutex mutex_;
  Registers registers_;
  std::array<Volts, 32> outside_{};
  std::uint32_t inputs_ = 0;  // at the last follow()
  // outputs that were reported as high; 0 at first, so that all are reported
  std::uint32_t told_ = 0;
  std::uint32_t stuck_ = 0;
};

}  // namespace mpf
