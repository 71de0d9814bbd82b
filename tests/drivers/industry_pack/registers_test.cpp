// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/registers.h>

#include <gmock/gmock.h>
#include <stdexcept>

#include "recorded_registers.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

TEST(RegistersTest, PassAnAccessToTheEndOfTheSpaceWithItsWidth) {
  RecordedRegisters registers(8);
  registers.write32(4, 0x12345678);
  registers.write16(6, 0xabcd);
  registers.write8(7, 0xef);
  EXPECT_THAT(registers.takeAccesses(),
              ElementsAre("write32 4 12345678", "write16 6 abcd", "write8 7 ef"));

  EXPECT_EQ(registers.read8(7), 0xef);
  EXPECT_EQ(registers.read16(6), 0xabef);
  EXPECT_EQ(registers.read32(4), 0x1234abefU);
  EXPECT_THAT(registers.takeAccesses(), ElementsAre("read8 7", "read16 6", "read32 4"));
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

  EXPECT_THAT(registers.takeAccesses(), IsEmpty());
}

TEST(RegistersTest, RefuseUnalignedOffsetsWithoutAnAccess) {
  RecordedRegisters registers(8);
  EXPECT_THAT([&] { static_cast<void>(registers.read32(2)); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("a 32-bit register at 0x2: not a multiple of 4")));
  EXPECT_THROW(registers.write16(1, 0), std::invalid_argument);

  EXPECT_THAT(registers.takeAccesses(), IsEmpty());
}

}  // namespace
}  // namespace mpf::test
