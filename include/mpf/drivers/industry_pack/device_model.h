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
// Threads  any thread may run a bus cycle, also two at a time, so a model needs a lock of its own.
//          setInterrupt() may be called by any thread, also under that lock: the carrier does not
//          call the model from there.
// Crash    a model is memory of this process; nothing outlives it.
// Trust    a driver may access any offset and write any value, as on the real bus; a model must not
//          fail for accesses that a real module ignores.
// Source   ANSI/VITA 4-1995; the data sheet of the module for everything behind the bus.
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
  // The address space of a cycle. Cycles of the ID space do not reach the model: the carrier
  // answers them from id().
  enum class Space : std::uint8_t { io, memory };
  // The half of the data bus that takes part: D15..8 is the byte at the even address, D7..0 the
  // byte at the odd address.
  enum Lanes : std::uint16_t { kHigh = 0xff00, kLow = 0x00ff, kBoth = 0xffff };

  //   id  the contents of the ID PROM; with IdProm::hasValidCrc false, the PROM has a wrong CRC
  explicit DeviceModel(IdProm id) : id_(id) {}
  DeviceModel(const DeviceModel&) = delete;
  DeviceModel& operator=(const DeviceModel&) = delete;
  virtual ~DeviceModel() = default;

  // As passed to the constructor; valid as long as the model.
  [[nodiscard]] const IdProm& id() const noexcept { return id_; }

  // One cycle at the even address `offset`, which the carrier has checked: 0 to 126 in the I/O
  // space, below the size of the carrier's memory space in the memory space. Bits of lanes that do
  // not take part are ignored in a result and are 0 in a value. An access of 32 bits arrives as two
  // cycles, the high half at the lower address first. An exception reaches the caller of Registers.
  virtual std::uint16_t read(Space space, std::size_t offset, Lanes lanes) = 0;
  virtual void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) = 0;

  // Used by the carrier: sets the function that setInterrupt() calls from now on, and an empty
  // function removes it. Waits for a call of setInterrupt() that is in progress. `line` must not
  // call this model.
  using InterruptLine = std::function<void(int number, bool active)>;
  void connectInterrupts(InterruptLine line) {
    const std::lock_guard lock(lineMutex_);
    line_ = std::move(line);
  }

 protected:
  // Drives IntReq0* (number 0) or IntReq1* (1); the level stays until the next call. Without a
  // carrier the level is lost: a model that is plugged in starts with both lines inactive.
  //   throws  std::out_of_range for another number
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
