// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/memory_registers.h>

#include <endian.h>

namespace mpf {
namespace {

template <class Value>
volatile Value& at(volatile std::byte* window, std::size_t offset) noexcept {
  return *reinterpret_cast<volatile Value*>(window + offset);
}

}  // namespace

std::uint8_t MemoryRegisters::doRead8(std::size_t offset) {
  return at<std::uint8_t>(window_, offset);
}
std::uint16_t MemoryRegisters::doRead16(std::size_t offset) {
  return be16toh(at<std::uint16_t>(window_, offset));
}
std::uint32_t MemoryRegisters::doRead32(std::size_t offset) {
  return be32toh(at<std::uint32_t>(window_, offset));
}
void MemoryRegisters::doWrite8(std::size_t offset, std::uint8_t value) {
  at<std::uint8_t>(window_, offset) = value;
}
void MemoryRegisters::doWrite16(std::size_t offset, std::uint16_t value) {
  at<std::uint16_t>(window_, offset) = htobe16(value);
}
void MemoryRegisters::doWrite32(std::size_t offset, std::uint32_t value) {
  at<std::uint32_t>(window_, offset) = htobe32(value);
}

}  // namespace mpf
