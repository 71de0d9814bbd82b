// SPDX-License-Identifier: MIT
// DeviceModel: a module that is not there. It behaves like the chips on it: what reading and writing does, when it interrupts.
//
//   class Dac128vModel : public DeviceModel { ... };
//   auto carrier = std::make_unique<ModelCarrier>();
//   auto& dac = carrier->plug("IP_a", std::make_unique<Dac128vModel>());   // as into a real carrier
//
// A model sees bus cycles, not registers: a 16-bit word of which one or both byte lanes take part, as the module's connector has it.
//
// Threads  cycles come from any thread, also two at once: a model has a lock of its own. setInterrupt() from any.
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
  // Which half of the data bus takes part: D15..8 is the byte at the even address, D7..0 that at the odd one.
  enum Lanes : std::uint16_t { kHigh = 0xff00, kLow = 0x00ff, kBoth = 0xffff };

  explicit DeviceModel(IdProm id) : id_(id) {}
  DeviceModel(const DeviceModel&) = delete;
  DeviceModel& operator=(const DeviceModel&) = delete;
  virtual ~DeviceModel() = default;

  [[nodiscard]] const IdProm& id() const noexcept { return id_; }

  // One cycle at the even address `offset`. Bits of lanes that take no part are ignored.
  virtual std::uint16_t read(Space space, std::size_t offset, Lanes lanes) = 0;
  virtual void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) = 0;

  // For the carrier: who is told when a request line changes.
  using InterruptLine = std::function<void(int number, bool active)>;
  void connectInterrupts(InterruptLine line) {
    const std::lock_guard lock(lineMutex_);
    line_ = std::move(line);
  }

 protected:
  // Drives IntReq0* or IntReq1*; the level holds until it is changed.
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
