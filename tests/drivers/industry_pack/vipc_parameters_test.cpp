// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <utility>

#include "parameters_cases.h"

namespace mpf::test {
namespace {

constexpr GoodParameters kGoodVipc[]{
    {"vipc310", "", "6000 6080 4,5; 6100 6180 2,1"},
    {"vipc310", "1000,512", "1000 1080 100000+512K 4,5; 1100 1180 180000+512K 2,1"},
    {"vipc310", "0xfe00, 128", "fe00 fe80 4,5; ff00 ff80 fe0000+128K 2,1"},
    {"vipc310", "0x6000,0", "6000 6080 4,5; 6100 6180 2,1"},
    {"vipc610", "0x6000", "6000 6080 1,2; 6100 6180 3,4; 6200 6280 5,6; 6300 6380 7,0"},
    {"vipc610", "7000,1024",
     "7000 7080 1,2; 7100 7180 3,4; 7200 7280 5,6; 7300 7380 700000+1024K 7,0"},
    {"vipc610", "1200,128",
     "1000 1080 1,2; 1100 1180 120000+128K 3,4; 1200 1280 140000+128K 5,6; 1300 1380 160000+128K "
     "7,0"},
    {"vipc610_01", "1000,128",
     "1000 1080 100000+128K 4,5; 1100 1180 120000+128K 2,1; 1200 1280 140000+128K 4,5; 1300 1380 "
     "160000+128K 2,1"},
    {"vipc616", "",
     "6000 6080 d0000000+8192K 1,2; 6100 6180 d0800000+8192K 3,4; 6200 6280 d1000000+8192K 5,6; "
     "6300 6380 d1800000+8192K 7,0"},
    {"vipc616", "0xfc00", "fc00 fc80 1,2; fd00 fd80 3,4; fe00 fe80 5,6; ff00 ff80 7,0"},
    {"vipc616_01", "0x3000,0xa0000000",
     "3000 3080 a0000000+8192K 4,5; 3100 3180 a0800000+8192K 2,1; 3200 3280 a1000000+8192K 4,5; "
     "3300 3380 a1800000+8192K 2,1"},
    {"&vipc616_01", "0x6000,D00000,128",
     "6000 6080 d00000+128K 4,5; 6100 6180 d20000+128K 2,1; 6200 6280 d40000+128K 4,5; 6300 6380 "
     "d60000+128K 2,1"},
    {"ipacAddVIPC616_01", "6000,700000,1024",
     "6000 6080 4,5; 6100 6180 2,1; 6200 6280 4,5; 6300 6380 700000+1024K 2,1"},
};

TEST(VipcParametersTest, GiveTheAddressesOfTheSites) {
  for (const auto& good : kGoodVipc) expectSites(good);
}

constexpr BadParameters kBadVipc[]{
    {"vipc310", "0x6100", IndustryPackStatus::badAddress,
     "I/O address 0x6100: use a multiple of 0x200, 0x0 to 0xfe00"},
    {"vipc310", "0x10000", IndustryPackStatus::badAddress, "I/O address 0x10000"},
    {"vipc310", "0x6000,100", IndustryPackStatus::badAddress, "memory size [K] 100"},
    {"vipc310", "0x6000,192", IndustryPackStatus::badAddress, "memory size 192 K"},
    {"vipc310", "0x6000,4096", IndustryPackStatus::badAddress,
     "memory size [K] 4096: use a multiple of 64, 0 to 2048"},
    {"vipc310", "0x6000,", IndustryPackStatus::badAddress, "the memory size [K] is missing"},
    {"vipc310", "ipac", IndustryPackStatus::badAddress,
     "the I/O address is not a number: \"ipac\""},
    {"vipc310", "0x6000,128,3", IndustryPackStatus::badAddress, "unexpected \",3\" at the end"},
    {"vipc610", "0xfe00", IndustryPackStatus::badAddress, "I/O address 0xfe00"},
    {"vipc610", "-0x6000", IndustryPackStatus::badAddress, "the I/O address is not a number"},
    {"vipc616", "0x6200", IndustryPackStatus::badAddress, "a multiple of 0x400"},
    {"vipc616", "0x3000,0xa1000000", IndustryPackStatus::badAddress,
     "memory address 0xa1000000: use a multiple of 0x2000000 in A32"},
    {"vipc616", "0x3000,D00000", IndustryPackStatus::badAddress, "add a size [K] for A24"},
    {"vipc616_01", "0x6000,0xa0000000,128", IndustryPackStatus::badAddress,
     "memory address 0xa0000000: use a multiple of 0x20000 in A24"},
    {"vipc616", "0x3000,0x123456789", IndustryPackStatus::badAddress, "memory address 123456789"},
};

TEST(VipcParametersTest, AreRefusedWithAnErrorThatNamesTheInvalidPart) {
  for (const auto& bad : kBadVipc) expectRefused(bad);
}

TEST(VipcParametersTest, PutTheMemoryIntoA24WhenItsSizeIsGiven) {
  for (const auto& [kind, text] :
       {std::pair{"vipc310", "6000,128"}, {"vipc610", "6000"}, {"vipc616", "3000,D00000,64"}}) {
    const auto carrier = parseCarrierParameters(kind, text);
    EXPECT_EQ(carrier.registers, BusSpace::vmeA16) << kind;
    EXPECT_EQ(carrier.memory, BusSpace::vmeA24) << kind;
  }
  EXPECT_EQ(parseCarrierParameters("vipc616", "").memory, BusSpace::vmeA32);
  EXPECT_EQ(parseCarrierParameters("vipc616_01", "3000,a0000000").memory, BusSpace::vmeA32);
}

}  // namespace
}  // namespace mpf::test
