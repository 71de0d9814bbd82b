// SPDX-License-Identifier: MIT
// MemoryRegisters: registers in a mapped window of a carrier, for example a PCI resource. Each
// access is volatile and has exactly the requested width; the bus behind the window is big-endian.
// For drivers of carriers; drivers of modules use Registers, which site.io() and the like return.
//
//   MemoryRegisters registers(mapped, 0x80);  // `mapped`: from mmap(2) of a PCI resource file
//   registers.write16(0x04, timer);           // offsets and checks: see Registers
//
// Threads  any number of callers at a time; nothing here locks.
// Crash    the window belongs to the caller, who maps and unmaps it; nothing is reset here.
// Trust    a PCI device that does not answer, or was pulled out, reads as ones in all bits.
// Source   ANSI/VITA 4-1995: the bus of the modules is big-endian, with 16 data lines.
#pragma once

#include <mpf/drivers/industry_pack/registers.h>

namespace mpf {

class MemoryRegisters final : public Registers {
 public:
  //   window  the first byte of the mapping, aligned to 4 bytes; not owned, and must stay mapped
  //           as long as this object exists. Each byte must be at the address that it has on the
  //           bus of the modules: set up the byte order of a bridge before.
  //   bytes   size of the window: an access beyond it throws std::out_of_range
  MemoryRegisters(volatile void* window, std::size_t bytes) noexcept
      : window_(static_cast<volatile std::byte*>(window)), bytes_(bytes) {}
  // [bytes] As passed to the constructor.
  [[nodiscard]] std::size_t size() const noexcept override { return bytes_; }

 private:
  // Registers has checked offset and alignment. A 32-bit access is one access of the processor,
  // which the carrier divides into two cycles of 16 bits.
  std::uint8_t doRead8(std::size_t offset) override;
  std::uint16_t doRead16(std::size_t offset) override;
  std::uint32_t doRead32(std::size_t offset) override;
  void doWrite8(std::size_t offset, std::uint8_t value) override;
  void doWrite16(std::size_t offset, std::uint16_t value) override;
  void doWrite32(std::size_t offset, std::uint32_t value) override;

  volatile std::byte* window_;
  std::size_t bytes_;
};

}  // namespace mpf
