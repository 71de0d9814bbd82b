// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "parameters_cases.h"

namespace mpf::test {
namespace {

constexpr GoodParameters kGoodMvme162[]{
    {"&ipmv162",
     "A:l=3,3 m=0xe0000000,64;B:l=3,3 m=0xe0010000,64;C:l=3,3 m=0xe0020000,64;D:l=3,3 "
     "m=0xe0030000,64",
     "fff58000 fff58080 e0000000+64K 3,3; fff58100 fff58180 e0010000+64K 3,3; fff58200 fff58280 "
     "e0020000+64K 3,3; "
     "fff58300 fff58380 e0030000+64K 3,3"},
    {"ipmv162", "A:m=0xe0000000,64 l=3,3;D:m=0xe0010000,64 l=3,3",
     "fff58000 fff58080 e0000000+64K 3,3; fff58100 fff58180 0,0; fff58200 fff58280 0,0; fff58300 "
     "fff58380 e0010000+64K 3,3"},
    {"ipacAddMVME162", "R A:m=0x80000000,1024 l=4;B:l=2,2;C:m=80100000,64 r=4 w=8",
     "fff58000 fff58080 80000000+1024K 4,0; fff58100 fff58180 2,2; fff58200 fff58280 80100000+64K "
     "0,0; fff58300 fff58380 0,0"},
    {"ipmv162", "A:l=3, m=0xe0000000,64 w=32",
     "fff58000 fff58080 e0000000+64K 3,0; fff58100 fff58180 0,0; fff58200 fff58280 0,0; "
     "fff58300 fff58380 0,0"},
    {"ipmv162", "A:m=0xffe00000,1024;B:m=0x10000,16384",
     "fff58000 fff58080 ffe00000+1024K 0,0; fff58100 fff58180 10000+16384K 0,0; fff58200 fff58280 "
     "0,0; fff58300 fff58380 0,0"},
    {"ipmv162", "B:m=0xe0010000,64;A:m=0xe0000000,128 w=32",
     "fff58000 fff58080 e0000000+128K 0,0; fff58100 fff58180 0,0; fff58200 fff58280 0,0; fff58300 "
     "fff58380 0,0"},
    {"ipmv162", "",
     "fff58000 fff58080 0,0; fff58100 fff58180 0,0; fff58200 fff58280 0,0; fff58300 fff58380 0,0"},
};

TEST(Mvme162ParametersTest, GiveTheAddressesOfTheSites) {
  for (const auto& good : kGoodMvme162) expectSites(good);
}

constexpr BadParameters kBadMvme162[]{
    {"ipmv162", "A:l=8", IndustryPackStatus::badIntLevel, "interrupt level 8: use 1 to 7, or 0"},
    {"ipmv162", "A:l=3,9", IndustryPackStatus::badIntLevel, "second interrupt level 9"},
    {"ipmv162", "A:l", IndustryPackStatus::badAddress, "expected '=' after the l"},
    {"ipmv162", "A:m=0xe0000000", IndustryPackStatus::badAddress,
     "expected ',' after the memory address"},
    {"ipmv162", "A:m=0xe0001000,64", IndustryPackStatus::badAddress,
     "memory address 0xe0001000: use a multiple of 0x10000"},
    {"ipmv162", "A:m=0xe0000000,32", IndustryPackStatus::badAddress, "memory size [K] 32"},
    {"ipmv162", "A:m=0xe0000000,32768", IndustryPackStatus::badAddress, "64 to 16384"},
    {"ipmv162", "A:m=0xffe00000,2048", IndustryPackStatus::badAddress,
     "the end is above 0xfff00000"},
    {"ipmv162", "A:m=0xe0000000,128;B:m=0xe0010000,64", IndustryPackStatus::badAddress,
     "the memory of site B overlaps with that of site A"},
    {"ipmv162", "A:r=9", IndustryPackStatus::badAddress, "recovery time [us] 9"},
    {"ipmv162", "A:w=24", IndustryPackStatus::badAddress, "width 24: use 8, 16 or 32"},
    {"ipmv162", "B:w=32", IndustryPackStatus::badAddress, "width 32 at site B"},
};

TEST(Mvme162ParametersTest, AreRefusedWithAnErrorThatNamesTheInvalidPart) {
  for (const auto& bad : kBadMvme162) expectRefused(bad);
}

TEST(Mvme162ParametersTest, GiveResetWidthAndRecoveryTimeOfEachSite) {
  const auto carrier = parseCarrierParameters("ipmv162", "R C:w=8 r=4 D:w=16 r=8");
  EXPECT_TRUE(carrier.isReset);
  EXPECT_EQ(carrier.registers, BusSpace::local);
  EXPECT_EQ(carrier.memory, BusSpace::local);
  EXPECT_EQ(carrier.sites[2].widthBits, 8);
  EXPECT_EQ(carrier.sites[2].recoveryUs, 4);
  EXPECT_EQ(carrier.sites[3].widthBits, 16);
  EXPECT_EQ(carrier.sites[3].recoveryUs, 8);
  EXPECT_EQ(carrier.sites[0].recoveryUs, 0);
  EXPECT_FALSE(parseCarrierParameters("ipmv162", "A:l=1").isReset);
}

}  // namespace
}  // namespace mpf::test
