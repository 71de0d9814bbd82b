// SPDX-License-Identifier: MIT
// DigitalIoModel: a module of digital lines that is not there.
//
//   DigitalIoModel model(*findDigitalIoKind("IP-Unidig-I"));
//   model.setInputs(0x3, 0x1);                       // bit 0 is high, somebody pulls bit 1 down
//   model.connect(5, [wire] { return wire.get(); });  // bit 5 follows a wire, in volts
//
//   outputs, enables ─► driver ─┐
//   outside: 5 V, 0 V, a wire ──┴► line ─► comparator ─► inputs ─► edge that is wanted ─► pending ─► IntReq0*
//
// A line that nobody drives is pulled up. Lines of the DIO316I's and the -HV and -12I12O models' outputs cannot be read: connect() them.
//
// Threads  as DeviceModel; all else any.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <mutex>

#include <mpf/drivers/digital_io/digital_io_kind.h>
#include <mpf/drivers/industry_pack/device_model.h>

namespace mpf {

class DigitalIoModel final : public DeviceModel {
 public:
  static constexpr double kHighVolts = 5;
  static constexpr double kTtlThresholdVolts = 1.5;

  // What an output gives, at power-up and whenever it changes. It must not touch the model.
  using OnOutput = std::function<void(int bit, double volts)>;
  using Volts = std::function<double()>;

  explicit DigitalIoModel(const DigitalIoKind& kind, OnOutput onOutput = {});

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

  // From outside, the bits of `mask` are high or low as in `bits`.
  void setInputs(std::uint32_t mask, std::uint32_t bits);
  // From outside, that bit is at so many volts; asked at each cycle and at look().
  void connect(int bit, Volts volts);
  // Tells the model that what it is connected to has changed.
  void look();

  [[nodiscard]] std::uint32_t inputs() const;   // as one would read them
  [[nodiscard]] std::uint32_t outputs() const;  // the register
  [[nodiscard]] std::uint32_t driven() const;   // lines that are outputs now
  [[nodiscard]] int vector() const;
  // Bits of the output registers that are stuck at 0: a fault.
  void setStuck(std::uint32_t bits);

 private:
  struct Registers {
    std::uint32_t output = 0xffffffff, outputEnable = 0, interruptEnable = 0, polarity = 0, pending = 0;
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
  std::uint32_t inputs_ = 0;      // as seen last
  std::uint32_t told_ = 0;        // outputs that were told as high; none yet: all are news
  std::uint32_t stuck_ = 0;
};

}  // namespace mpf
