// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/memory_registers.h>

#include <array>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

TEST(MemoryRegistersTest, AreBigEndianAndAccessedWithTheGivenWidth) {
  alignas(4) std::array<std::uint8_t, 8> window{0x12, 0x34, 0x56, 0x78};
  MemoryRegisters registers(window.data(), window.size());
  EXPECT_EQ(registers.read8(1), 0x34);
  EXPECT_EQ(registers.read16(2), 0x5678);
  EXPECT_EQ(registers.read32(0), 0x12345678u);
  registers.write16(4, 0xabcd);
  EXPECT_EQ(window[4], 0xab);
  EXPECT_EQ(window[5], 0xcd);
  registers.write8(6, 0xef);
  EXPECT_EQ(window[6], 0xef);
  EXPECT_EQ(window[7], 0);
  registers.write32(4, 0x01020304);
  EXPECT_EQ(window, (std::array<std::uint8_t, 8>{0x12, 0x34, 0x56, 0x78, 1, 2, 3, 4}));
}

TEST(MemoryRegistersTest, SeeEachChangeOfTheWindow) {
  alignas(4) std::array<std::uint8_t, 4> window{};
  MemoryRegisters registers(window.data(), window.size());
  EXPECT_EQ(registers.size(), 4U);
  EXPECT_EQ(registers.read16(2), 0);
  window = {0, 0, 0xff, 1};
  EXPECT_EQ(registers.read16(2), 0xff01);
}

}  // namespace
}  // namespace mpf::test
