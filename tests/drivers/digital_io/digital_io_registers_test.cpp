// SPDX-License-Identifier: MIT
#include "drivers/digital_io/digital_io_registers.h"

#include <gmock/gmock.h>
#include <string>

#include "tests/drivers/industry_pack/recorded_registers.h"

namespace mpf::test {
namespace {

namespace word = digital_io_word;
using testing::ElementsAre;
using testing::IsEmpty;

class DigitalIoRegistersTest : public testing::Test {
 protected:
  DigitalIoRegisters of(const char* name) { return {io_, *findDigitalIoKind(name)}; }
  // Sets up a module of that kind, whose registers had these values. Returns the accesses.
  std::vector<std::string> setUp(const char* name, std::uint16_t before, int threshold = 0) {
    for (std::size_t word = 0; word < io_.size() / 2; ++word) io_.write16(2 * word, before);
    static_cast<void>(io_.takeAccesses());
    of(name).setUp(threshold);
    return io_.takeAccesses();
  }
  RecordedRegisters io_{128};
};

TEST_F(DigitalIoRegistersTest, AccessAPairAsOneValue) {
  auto registers = of("IP-Unidig");
  registers.write(word::kInput, 0xffffff, 0x563412);
  EXPECT_THAT(io_.takeAccesses(), ElementsAre("write16 4 3412", "write16 6 56"));

  EXPECT_EQ(registers.read(word::kInput, 0xffffff), 0x563412U);
  EXPECT_THAT(io_.takeAccesses(), ElementsAre("read16 4", "read16 6"));
}

TEST_F(DigitalIoRegistersTest, AccessNoHalfThatTheMaskOmits) {
  auto registers = of("IP-Unidig");
  registers.write(word::kOutput, 0x00ff, 0x11112222);
  registers.write(word::kOutput, 0x10000, 0x11113333);
  EXPECT_THAT(io_.takeAccesses(), ElementsAre("write16 0 2222", "write16 2 1111"));

  EXPECT_EQ(registers.read(word::kOutput, 0xff), 0x2222U);
  EXPECT_EQ(registers.read(word::kOutput, 0x10000), 0x11110000U);
  EXPECT_EQ(registers.read(word::kOutput, 0), 0U);
  EXPECT_THAT(io_.takeAccesses(), ElementsAre("read16 0", "read16 2"));
}

TEST_F(DigitalIoRegistersTest, AreAllOnesIfEachHalfOfTheMaskIs) {
  EXPECT_TRUE(DigitalIoRegisters::isAllOnes(0xffffffff, 0xffffff));
  EXPECT_FALSE(DigitalIoRegisters::isAllOnes(0x00ffffff, 0xffffff)) << "bits without a function";
  EXPECT_FALSE(DigitalIoRegisters::isAllOnes(0xfffffffe, 0xffffff));
  EXPECT_TRUE(DigitalIoRegisters::isAllOnes(0x0000ffff, 0xffff));
  EXPECT_TRUE(DigitalIoRegisters::isAllOnes(0xffff0000, 0xff0000));
  EXPECT_FALSE(DigitalIoRegisters::isAllOnes(0xffff0000, 0xff0001));
}

TEST_F(DigitalIoRegistersTest, OfASystranModuleEnableAllPortsAndKeepOtherBits) {
  EXPECT_THAT(setUp("DIO316I", 0x1230, 166),
              ElementsAre("read16 6", "write16 6 123f", "read16 8", "write16 8 1233"));
}

TEST_F(DigitalIoRegistersTest, OfAnOpticalModuleSwitchTheDriversOnAndKeepOtherBits) {
  EXPECT_THAT(setUp("IP-Unidig-O-24IO", 0x1201, 166), ElementsAre("read16 12", "write16 12 1205"));
}

TEST_F(DigitalIoRegistersTest, OfAModuleWithAComparatorGetItsThreshold) {
  EXPECT_THAT(setUp("IP-Unidig-HV-16I8O", 0, 166), ElementsAre("write16 28 a6"));
}

TEST_F(DigitalIoRegistersTest, OfAPlainModuleNeedNoSetUp) {
  EXPECT_THAT(setUp("IP-Unidig", 0, 166), IsEmpty());
}

}  // namespace
}  // namespace mpf::test
