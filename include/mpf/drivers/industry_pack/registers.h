// SPDX-License-Identifier: MIT
// Registers: one address space of an Industry Pack module: of a chip behind the window of a
// carrier, or of a device model.
//
//   registers.write16(0x04, timer);      // one bus cycle of exactly that width
//   const auto status = registers.read8(0x03);
//
// Offsets are byte addresses of the bus, which is big-endian: the high byte of the 16-bit register
// at 0x40 is at 0x40, the low byte at 0x41. Values are in the byte order of this host. Where
// nothing answers (no module, a bus error, a board that was pulled out), all bits read as ones.
//
// Threads  any number of callers at a time; a driver locks when it needs several accesses in
//          sequence.
// Crash    each access is complete or not made.
// Trust    values from a module may be anything.
// Source   ANSI/VITA 4-1995: I/O space 128 bytes, ID space 64 or 128 bytes, memory space up to 8
//          MiB.
#pragma once

#include <cstddef>
#include <cstdint>

namespace mpf {

class Registers {
 public:
  Registers() = default;
  Registers(const Registers&) = delete;
  Registers& operator=(const Registers&) = delete;
  virtual ~Registers() = default;

  // Bytes of the space; 0 when the site has none.
  [[nodiscard]] virtual std::size_t size() const noexcept = 0;

  // Not const: reading a chip may have side effects. An access of 32 bits on a 16-bit bus is two
  // cycles, the high half first.
  //   throws  std::out_of_range beyond size(), std::invalid_argument unless `offset` is a multiple
  //           of the width
  [[nodiscard]] std::uint8_t read8(std::size_t offset) { return check(offset, 1), doRead8(offset); }
  [[nodiscard]] std::uint16_t read16(std::size_t offset) {
    return check(offset, 2), doRead16(offset);
  }
  [[nodiscard]] std::uint32_t read32(std::size_t offset) {
    return check(offset, 4), doRead32(offset);
  }
  void write8(std::size_t offset, std::uint8_t value) { check(offset, 1), doWrite8(offset, value); }
  void write16(std::size_t offset, std::uint16_t value) {
    check(offset, 2), doWrite16(offset, value);
  }
  void write32(std::size_t offset, std::uint32_t value) {
    check(offset, 4), doWrite32(offset, value);
  }

 private:
  void check(std::size_t offset, std::size_t width) const;
  virtual std::uint8_t doRead8(std::size_t offset) = 0;
  virtual std::uint16_t doRead16(std::size_t offset) = 0;
  virtual std::uint32_t doRead32(std::size_t offset) = 0;
  virtual void doWrite8(std::size_t offset, std::uint8_t value) = 0;
  virtual void doWrite16(std::size_t offset, std::uint16_t value) = 0;
  virtual void doWrite32(std::size_t offset, std::uint32_t value) = 0;
};

}  // namespace mpf
