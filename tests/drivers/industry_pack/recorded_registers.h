// SPDX-License-Identifier: MIT
// RecordedRegisters: an address space in memory that records each access.
//
//   RecordedRegisters registers(8);
//   registers.write16(6, 0xabcd);
//   registers.takeAccesses()         // "write16 6 abcd"
#pragma once

#include <cstdint>
#include <fmt/format.h>
#include <string>
#include <utility>
#include <vector>

#include <mpf/drivers/industry_pack/registers.h>

namespace mpf::test {

class RecordedRegisters final : public Registers {
 public:
  explicit RecordedRegisters(std::size_t bytes) : bytes_(bytes) {}
  [[nodiscard]] std::size_t size() const noexcept override { return bytes_.size(); }
  // The accesses since the last call; offsets are decimal, values hexadecimal.
  [[nodiscard]] std::vector<std::string> takeAccesses() { return std::exchange(accesses_, {}); }

 private:
  template <class Value>
  Value read(std::size_t offset) {
    accesses_.push_back(fmt::format("read{} {}", 8 * sizeof(Value), offset));
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < sizeof(Value); ++i) value = value << 8 | bytes_[offset + i];
    return static_cast<Value>(value);
  }
  template <class Value>
  void write(std::size_t offset, Value value) {
    accesses_.push_back(fmt::format("write{} {} {:x}", 8 * sizeof(Value), offset, value));
    for (std::size_t i = 0; i < sizeof(Value); ++i)
      bytes_[offset + i] = static_cast<std::uint8_t>(value >> (8 * (sizeof(Value) - 1 - i)));
  }
  std::uint8_t doRead8(std::size_t offset) override { return read<std::uint8_t>(offset); }
  std::uint16_t doRead16(std::size_t offset) override { return read<std::uint16_t>(offset); }
  std::uint32_t doRead32(std::size_t offset) override { return read<std::uint32_t>(offset); }
  void doWrite8(std::size_t offset, std::uint8_t value) override { write(offset, value); }
  void doWrite16(std::size_t offset, std::uint16_t value) override { write(offset, value); }
  void doWrite32(std::size_t offset, std::uint32_t value) override { write(offset, value); }

  std::vector<std::uint8_t> bytes_;
  std::vector<std::string> accesses_;
};

}  // namespace mpf::test
