// SPDX-License-Identifier: MIT
// Ti9914Model: device model of a GreenSpring IP-488: a TI9914 in charge of a GpibBusModel.
//
//   auto bus = std::make_shared<GpibBusModel>();
//   bus->attach({22}, std::make_shared<MeterModel>());
//   carrier.plug("IP_a", std::make_unique<Ti9914Model>(bus));
//
//   ISR, IMR ─► IntReq0*        AUXCR ─► ATN, IFC, REN; talker, listener; holdoff
//   CDOR ─► source handshake ─► bus ─► acceptor handshake ─► DIR
//
// Threads  as DeviceModel.
// Source   TMS9914A data manual. Not modelled: the chip as a device (addresses, serial and parallel
//          poll, remote and local), parallel poll, fast T1.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include <mpf/clock.h>
#include <mpf/drivers/industry_pack/device_model.h>

#include "drivers/gpib/acceptor.h"
#include "drivers/gpib/bus_model.h"
#include "drivers/gpib/bus_participant.h"

namespace mpf {

class Ti9914Model final : public DeviceModel, private GpibParticipant {
 public:
  //   now  the time [ns], which decides whether a command comes too soon
  explicit Ti9914Model(std::shared_ptr<GpibBusModel> bus,
                       std::function<std::int64_t()> now = Clock::nowNs);
  ~Ti9914Model() override;

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

  // Commands that the chip lost because they came too soon after another one.
  [[nodiscard]] std::uint64_t lostCommands() const;
  [[nodiscard]] int vector() const;

 private:
  // What the bytes in CDOR are.
  enum class Source : std::uint8_t { none, commands, data };
  struct OutputByte {
    std::uint8_t value = 0;
    bool end = false;
  };
  // What AUXCR has set.
  struct States {
    bool isReset = true;
    bool isInCharge = false;
    bool drivesAttention = false;
    bool drivesInterfaceClear = false;
    bool drivesRemoteEnable = false;
    bool isTalker = false;
    bool isListener = false;
    bool holdsOffAll = false;
    bool holdsOffEnd = false;
    bool hasNoInterrupts = false;
  };

  GpibLines follow(const GpibLines& seen) override;
  bool offer(const GpibLines& seen) override;
  std::uint8_t readRegister(std::size_t offset, const GpibLines& lines);
  void writeRegister(std::size_t offset, std::uint8_t value, const GpibLines& lines);
  void command(std::uint8_t command, const GpibLines& lines);
  void execute(std::uint8_t command, bool set, const GpibLines& lines);
  void takeControl() noexcept;
  void reset(bool on);
  void followSource(const GpibLines& seen);
  std::uint8_t followAcceptor(const GpibLines& seen);
  bool take(const GpibLines& seen);
  [[nodiscard]] bool seesAttention(const GpibLines& seen) const noexcept;
  void raise(std::uint8_t& isr, std::uint8_t events);
  void followInterrupt();

  const std::shared_ptr<GpibBusModel> bus_;
  const std::function<std::int64_t()> now_;
  // guarded by the bus
  States states_;
  GpibAcceptor acceptor_;
  Source source_ = Source::none;
  std::optional<OutputByte> output_;  // CDOR
  bool isOffered_ = false;  // output_ is on the bus, with DAV
  bool hasNoAcceptor_ = false;  // reported for output_
  bool forcesEnd_ = false;
  std::uint8_t input_ = 0;  // DIR
  bool hasInput_ = false;
  bool holdsOff_ = false;
  bool sawServiceRequest_ = false;
  std::uint8_t isr0_ = 0, isr1_ = 0, imr0_ = 0, imr1_ = 0, vector_ = 0x0f;
  bool isInterrupting_ = false;
  std::int64_t commandAtNs_ = 0;
  std::uint64_t lostCommands_ = 0;
};

}  // namespace mpf
