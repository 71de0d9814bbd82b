// SPDX-License-Identifier: MIT
// DeviceModel: base class of device models. A model behaves like the chips of a module, side
// effects of reads and writes and interrupts included.
//
//   class Dac128vModel : public DeviceModel { ... };
//   auto carrier = std::make_unique<ModelCarrier>();
//   auto& dac = carrier->plug("IP_a", std::make_unique<Dac128vModel>());   // like a real module
//
// A model receives bus cycles, not register accesses: each cycle transfers a 16-bit word, in which
// one or both byte lanes take part, as on the connector of the module.
//
// Threads  cycles come from any thread, also two at a time, so a model needs a lock of its own.
//          setInterrupt() may be called by any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <utility>

#include <mpf/drivers/industry_pack/id_prom.h>

namespace mpf {

class DeviceModel {
 public:
  enum class Space : std::uint8_t { io, memory };
  // The half of the data bus that takes part: D15..8 is the byte at the even address, D7..0 the
  // byte at the odd address.
  enum Lanes : std::uint16_t { kHigh = 0xff00, kLow = 0x00ff, kBoth = 0xffff };

  explicit DeviceModel(IdProm id) : id_(id) {}
  DeviceModel(const DeviceModel&) = delete;
  DeviceModel& operator=(const DeviceModel&) = delete;
  virtual ~DeviceModel() = default;

  [[nodiscard]] const IdProm& id() const noexcept { return id_; }

  // One cycle at the even address `offset`. Bits of lanes that do not take part are ignored.
  virtual std::uint16_t read(Space space, std::size_t offset, Lanes lanes) = 0;
  virtual void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) = 0;

  // Used by the carrier: `line` is called when an interrupt request line changes.
  using InterruptLine = std::function<void(int number, bool active)>;
  void connectInterrupts(InterruptLine line) {
    const std::lock_guard lock(lineMutex_);
    line_ = std::move(line);
  }

 protected:
  // Drives IntReq0* (number 0) or IntReq1* (1); the level stays until the next call.
  void setInterrupt(int number, bool active) {
    const std::lock_guard lock(lineMutex_);
    if (line_) line_(number, active);
  }

 private:
  IdProm id_;
  std::mutex lineMutex_;
  InterruptLine line_;
};

}  // namespace mpf
