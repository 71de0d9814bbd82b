// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "drivers/industry_pack/parameter_parsers.h"
#include "parameters_cases.h"

namespace mpf::test {
namespace {

constexpr GoodParameters kGoodSwitched[]{
    {"tvme200", "6010D0", "6000 6080 1,2; 6100 6180 3,4; 6200 6280 5,6; 6300 6380 7,0"},
    {"TVME200", "602fb0",
     "6000 6080 b0000000+8192K 4,5; 6100 6180 b0800000+8192K 2,1; 6200 6280 b1000000+8192K 4,5; "
     "6300 6380 b1800000+8192K 2,1"},
    {"ipacAddTVME200", "100580",
     "1000 1080 800000+512K 0,0; 1100 1180 880000+512K 0,0; 1200 1280 900000+512K 0,0; 1300 1380 "
     "980000+512K 0,0"},
    {"tvme200", "600780",
     "6000 6080 800000+2048K 0,0; 6100 6180 a00000+2048K 0,0; 6200 6280 c00000+2048K 0,0; 6300 "
     "6380 e00000+2048K 0,0"},
    {"hy8004", "21,7, MEMBASE=0xff80",
     "a800 a880 ff800000+1024K 7,7; a900 a980 ff900000+1024K 7,7; aa00 aa80 ffa00000+1024K 7,7; "
     "ab00 ab80 ffb00000+1024K 7,7"},
    {"hy8002", "3,2",
     "1800 1880 c00000+1024K 2,2; 1900 1980 d00000+1024K 2,2; 1a00 1a80 e00000+1024K 2,2; 1b00 "
     "1b80 f00000+1024K 2,2"},
    {"hy8004", "3,2 IPMEM=2, MEMBASE=0x9000,IPCLCK=32 ROAK=1",
     "1800 1880 90000000+2048K 2,2; 1900 1980 90200000+2048K 2,2; 1a00 1a80 90400000+2048K 2,2; "
     "1b00 1b80 90600000+2048K 2,2"},
    {"hy8004", "3,2 MEMBASE=0xffc0",
     "1800 1880 ffc00000+1024K 2,2; 1900 1980 ffd00000+1024K 2,2; 1a00 1a80 ffe00000+1024K 2,2; "
     "1b00 1b80 fff00000+1024K 2,2"},
    {"hy8004", "3,2 IPMEM=4 MEMBASE=0xff00",
     "1800 1880 ff000000+4096K 2,2; 1900 1980 ff400000+4096K 2,2; 1a00 1a80 ff800000+4096K 2,2; "
     "1b00 1b80 ffc00000+4096K 2,2"},
    {"hy8002", "1,0 IPMEM=8 IPCLK=8",
     "800 880 8000000+8192K 0,0; 900 980 8800000+8192K 0,0; a00 a80 9000000+8192K 0,0; b00 b80 "
     "9800000+8192K 0,0"},
    {"xy9660", "0x6000,4 R", "6000 6080 4,4; 6100 6180 4,4; 6200 6280 4,4; 6300 6380 4,4"},
    {"ipacAddAvme96XX", "C000,3 A=2,800000 c = 1, A00000",
     "c000 c080 800000+2048K 3,3; c100 c180 3,3; c200 c280 a00000+1024K 3,3; c300 c380 3,3"},
    {"atc40", "",
     "a0000 a0080 a0800+2K 11,11; a0100 a0180 a1000+2K 11,11; a0200 a0280 a1800+2K 11,11; a0300 "
     "a0380 a2000+2K 11,11"},
    {"avme96xx", "FC00,0 B=1,900000 A=1,800000",
     "fc00 fc80 800000+1024K 0,0; fd00 fd80 900000+1024K 0,0; fe00 fe80 0,0; ff00 ff80 0,0"},
    {"atc40", "0xfc0000 0x4000 5",
     "fc0000 fc0080 fc0800+2K 5,5; fc0100 fc0180 fc1000+2K 5,5; fc0200 fc0280 fc1800+2K 5,5; "
     "fc0300 fc0380 fc2000+2K 5,5"},
};

TEST(SwitchedParametersTest, GiveTheAddressesOfTheSites) {
  for (const auto& good : kGoodSwitched) expectSites(good);
}

constexpr BadParameters kBadSwitched[]{
    {"tvme200", "", IndustryPackStatus::badAddress, "six hexadecimal digits"},
    {"tvme200", "0x6010D0", IndustryPackStatus::badAddress, "six hexadecimal digits"},
    {"tvme200", "6110D0", IndustryPackStatus::badAddress, "switch S2 at 1: use 0, 4, 8 or C"},
    {"tvme200", "6050D0", IndustryPackStatus::badIntLevel, "switch S3 at 5: use 0 to 4"},
    {"tvme200", "6018D0", IndustryPackStatus::badAddress, "switch S4 at 8"},
    {"tvme200", "102670", IndustryPackStatus::badAddress,
     "switches S5 and S6 at 70: 0x700000 is not a multiple of 0x400000"},
    {"hy8002", "", IndustryPackStatus::badAddress, "the slot is missing"},
    {"hy8002", "22,2", IndustryPackStatus::badAddress, "slot 22: use 0 to 21"},
    {"hy8002", "3", IndustryPackStatus::badAddress, "expected ',' after the slot"},
    {"hy8002", "3,8", IndustryPackStatus::badIntLevel, "interrupt level 8"},
    {"hy8002", "3,2 IPMEM=3", IndustryPackStatus::badAddress, "IPMEM 3: use 1, 2, 4 or 8"},
    {"hy8002", "3,2 IPMEM=4", IndustryPackStatus::badAddress, "IPMEM 4 needs a MEMBASE"},
    {"hy8002", "16,2 IPMEM=2", IndustryPackStatus::badAddress,
     "IPMEM 2 in slot 16 needs a MEMBASE"},
    {"hy8002", "3,2 IPMEM=4 MEMBASE=0x9080", IndustryPackStatus::badAddress, "a multiple of 0x100"},
    {"hy8002", "3,2 MEMBASE=0x10000", IndustryPackStatus::badAddress, "MEMBASE 0x10000"},
    {"hy8004", "3,2 IPCLK=16", IndustryPackStatus::badAddress, "IPCLK 16: use 8 or 32"},
    {"hy8004", "3,2 ROAK=2", IndustryPackStatus::badAddress, "ROAK 2"},
    {"hy8004", "3,2 CLOCK=8", IndustryPackStatus::badAddress,
     "\"CLOCK=8\": use IPMEM, MEMBASE, IPCLK or ROAK"},
    {"xy9660", "0x6000", IndustryPackStatus::badAddress, "expected ',' after the I/O address"},
    {"xy9660", "0x6000,8", IndustryPackStatus::badIntLevel, "interrupt level 8"},
    {"xy9660", "0x6000,4 E=1,800000", IndustryPackStatus::badAddress,
     "\"E=1,800000\": use the sites A, B, C or D"},
    {"xy9660", "0x6000,4 A=3,800000", IndustryPackStatus::badAddress, "memory size [M] 3"},
    {"xy9660", "0x6000,4 A=2,900000", IndustryPackStatus::badAddress,
     "memory address 0x900000: use a multiple of 0x200000"},
    {"avme96xx", "0x6000,4 A=1,1000000", IndustryPackStatus::badAddress,
     "memory address 0x1000000"},
    {"avme96xx", "0x6000,4 A=2,800000 B=1,900000", IndustryPackStatus::badAddress,
     "the memory of site B overlaps with that of site A"},
    {"atc40", "0x1000,0x4000,11", IndustryPackStatus::badAddress,
     "separate the parameters with blanks"},
    {"atc40", "0xa0000 512", IndustryPackStatus::badAddress, "size [bytes] 512"},
    {"atc40", "0xa0000 0x4000 16", IndustryPackStatus::badIntLevel,
     "interrupt request 16: use 0 to 15"},
    {"atc40", "0x1000000", IndustryPackStatus::badAddress, "address 0x1000000"},
};

TEST(SwitchedParametersTest, AreRefusedWithAnErrorThatNamesTheInvalidPart) {
  for (const auto& bad : kBadSwitched) expectRefused(bad);
}

TEST(SwitchedParametersTest, GiveClockResetAndAddressSpaces) {
  const auto hytec = parseCarrierParameters("hy8004", "3,2 IPCLK=32 ROAK=1");
  EXPECT_EQ(hytec.clockMHz, 32);
  EXPECT_TRUE(hytec.releasesOnAcknowledge);
  EXPECT_EQ(hytec.memory, BusSpace::vmeA32);
  const auto plain = parseCarrierParameters("hy8004", "3,2");
  EXPECT_EQ(plain.clockMHz, std::nullopt);
  EXPECT_FALSE(plain.releasesOnAcknowledge);
  EXPECT_TRUE(parseCarrierParameters("xy9660", "0,4 r").isReset);
  EXPECT_FALSE(parseCarrierParameters("xy9660", "0,4").isReset);
  EXPECT_EQ(parseCarrierParameters("tvme200", "602fb0").memory, BusSpace::vmeA32);
  EXPECT_EQ(parseCarrierParameters("tvme200", "100580").memory, BusSpace::vmeA24);
  EXPECT_EQ(parseCarrierParameters("atc40", "").registers, BusSpace::isa);
}

TEST(SwitchedParametersTest, OverlapWhenOneByteBelongsToTwoSites) {
  const ParameterText text("Board", "");
  auto sites = parameters::makeSites(3, 0);
  sites[0] = {.memory = 0xfff00000, .memoryBytes = 0x100000};  // to the end of the address space
  sites[2] = {.memory = 0xffe00000, .memoryBytes = 0x100000};
  EXPECT_NO_THROW(parameters::expectNoOverlap(text, sites));

  ++sites[2].memoryBytes;
  EXPECT_THROW(parameters::expectNoOverlap(text, sites), IndustryPackError);

  sites[0].memoryBytes = 0;
  EXPECT_NO_THROW(parameters::expectNoOverlap(text, sites));
}

}  // namespace
}  // namespace mpf::test
