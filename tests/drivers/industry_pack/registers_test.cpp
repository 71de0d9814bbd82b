// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/registers.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <stdexcept>
#include <string>

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// A space that records the last access.
class RecordedRegisters final : public Registers {
 public:
  explicit RecordedRegisters(std::size_t bytes) : bytes_(bytes) {}
  [[nodiscard]] std::size_t size() const noexcept override { return bytes_; }
  [[nodiscard]] const std::string& access() const { return access_; }

 private:
  template <class Value>
  Value read(std::size_t offset) {
    access_ = fmt::format("read{} {}", 8 * sizeof(Value), offset);
    return static_cast<Value>(0x12345678);
  }
  template <class Value>
  void write(std::size_t offset, Value value) {
    access_ = fmt::format("write{} {} {:x}", 8 * sizeof(Value), offset, value);
  }
  std::uint8_t doRead8(std::size_t offset) override { return read<std::uint8_t>(offset); }
  std::uint16_t doRead16(std::size_t offset) override { return read<std::uint16_t>(offset); }
  std::uint32_t doRead32(std::size_t offset) override { return read<std::uint32_t>(offset); }
  void doWrite8(std::size_t offset, std::uint8_t value) override { write(offset, value); }
  void doWrite16(std::size_t offset, std::uint16_t value) override { write(offset, value); }
  void doWrite32(std::size_t offset, std::uint32_t value) override { write(offset, value); }

  std::size_t bytes_;
  std::string access_ = "none";
};

TEST(RegistersTest, PassAnAccessToTheEndOfTheSpaceWithItsWidth) {
  RecordedRegisters registers(8);
  EXPECT_EQ(registers.read8(7), 0x78);
  EXPECT_EQ(registers.access(), "read8 7");
  EXPECT_EQ(registers.read16(6), 0x5678);
  EXPECT_EQ(registers.access(), "read16 6");
  EXPECT_EQ(registers.read32(4), 0x12345678U);
  EXPECT_EQ(registers.access(), "read32 4");
  registers.write8(7, 0xab);
  EXPECT_EQ(registers.access(), "write8 7 ab");
  registers.write16(6, 0xabcd);
  EXPECT_EQ(registers.access(), "write16 6 abcd");
  registers.write32(4, 0xabcdef01);
  EXPECT_EQ(registers.access(), "write32 4 abcdef01");
}

TEST(RegistersTest, RefuseOffsetsOutsideTheSpaceWithoutAnAccess) {
  RecordedRegisters registers(6);
  EXPECT_THAT([&] { static_cast<void>(registers.read16(6)); },
              ThrowsMessage<std::out_of_range>("a 16-bit register at 0x6: the space has 6 bytes"));
  EXPECT_THROW(static_cast<void>(registers.read32(4)), std::out_of_range) << "one half is inside";
  EXPECT_THROW(registers.write8(6, 0), std::out_of_range);
  for (const auto offset : {SIZE_MAX - 3, SIZE_MAX - 7})
    EXPECT_THROW(registers.write32(offset, 0), std::out_of_range) << "the end overflows";
  EXPECT_THROW(static_cast<void>(registers.read8(SIZE_MAX)), std::out_of_range);
  EXPECT_THROW(static_cast<void>(RecordedRegisters(0).read8(0)), std::out_of_range);

  EXPECT_EQ(registers.access(), "none");
}

TEST(RegistersTest, RefuseUnalignedOffsetsWithoutAnAccess) {
  RecordedRegisters registers(8);
  EXPECT_THAT([&] { static_cast<void>(registers.read32(2)); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("a 32-bit register at 0x2: not a multiple of 4")));
  EXPECT_THROW(registers.write16(1, 0), std::invalid_argument);

  EXPECT_EQ(registers.access(), "none");
}

}  // namespace
}  // namespace mpf::test
