// SPDX-License-Identifier: MIT
// MemoryRegisters: registers in a mapped window of a carrier, for example a PCI resource. Each
// access is volatile and has exactly the requested width; the bus behind the window is big-endian.
//
// Threads  any number of callers at a time.
#pragma once

#include <mpf/drivers/industry_pack/registers.h>

namespace mpf {

class MemoryRegisters final : public Registers {
 public:
  // `window` must outlive this object.
  MemoryRegisters(volatile void* window, std::size_t bytes) noexcept
      : window_(static_cast<volatile std::byte*>(window)), bytes_(bytes) {}
  [[nodiscard]] std::size_t size() const noexcept override { return bytes_; }

 private:
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
