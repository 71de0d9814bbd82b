// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/carrier_parameters.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <mpf/drivers/industry_pack/create_carrier.h>
#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf::test {
namespace {

using testing::HasSubstr;
using Status = IndustryPackStatus;

// "6000 6080 d0000000+8192K 1,2" for each site.
std::string textOf(const CarrierParameters& carrier) {
  std::string text;
  for (const auto& site : carrier.sites) {
    text += fmt::format("{}{:x} {:x}", text.empty() ? "" : "; ", site.io, site.id);
    if (site.memoryBytes != 0)
      text += fmt::format(" {:x}+{}K", site.memory, site.memoryBytes >> 10);
    text += fmt::format(" {},{}", site.interruptLevels[0], site.interruptLevels[1]);
  }
  return text;
}

struct GoodParameters {
  const char* kind;
  const char* text;
  const char* sites;
};

constexpr GoodParameters kGood[]{
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
    {"ipmv162", "",
     "fff58000 fff58080 0,0; fff58100 fff58180 0,0; fff58200 fff58280 0,0; fff58300 fff58380 0,0"},
    {"tvme200", "6010D0", "6000 6080 1,2; 6100 6180 3,4; 6200 6280 5,6; 6300 6380 7,0"},
    {"TVME200", "602fb0",
     "6000 6080 b0000000+8192K 4,5; 6100 6180 b0800000+8192K 2,1; 6200 6280 b1000000+8192K 4,5; "
     "6300 6380 b1800000+8192K 2,1"},
    {"ipacAddTVME200", "100580",
     "1000 1080 800000+512K 0,0; 1100 1180 880000+512K 0,0; 1200 1280 900000+512K 0,0; 1300 1380 "
     "980000+512K 0,0"},
    {"hy8002", "3,2",
     "1800 1880 c00000+1024K 2,2; 1900 1980 d00000+1024K 2,2; 1a00 1a80 e00000+1024K 2,2; 1b00 "
     "1b80 f00000+1024K 2,2"},
    {"hy8004", "3,2 IPMEM=2, MEMBASE=0x9000,IPCLCK=32 ROAK=1",
     "1800 1880 90000000+2048K 2,2; 1900 1980 90200000+2048K 2,2; 1a00 1a80 90400000+2048K 2,2; "
     "1b00 1b80 90600000+2048K 2,2"},
    {"hy8002", "1,0 IPMEM=8 IPCLK=8",
     "800 880 8000000+8192K 0,0; 900 980 8800000+8192K 0,0; a00 a80 9000000+8192K 0,0; b00 b80 "
     "9800000+8192K 0,0"},
    {"xy9660", "0x6000,4 R", "6000 6080 4,4; 6100 6180 4,4; 6200 6280 4,4; 6300 6380 4,4"},
    {"ipacAddAvme96XX", "C000,3 A=2,800000 c = 1, A00000",
     "c000 c080 800000+2048K 3,3; c100 c180 3,3; c200 c280 a00000+1024K 3,3; c300 c380 3,3"},
    {"atc40", "",
     "a0000 a0080 a0800+2K 11,11; a0100 a0180 a1000+2K 11,11; a0200 a0280 a1800+2K 11,11; a0300 "
     "a0380 a2000+2K 11,11"},
    {"atc40", "0xfc0000 0x4000 5",
     "fc0000 fc0080 fc0800+2K 5,5; fc0100 fc0180 fc1000+2K 5,5; fc0200 fc0280 fc1800+2K 5,5; "
     "fc0300 fc0380 fc2000+2K 5,5"},
};

TEST(CarrierParametersTest, GiveTheAddressesOfTheSites) {
  for (const auto& [kind, text, sites] : kGood)
    EXPECT_EQ(textOf(parseCarrierParameters(kind, text)), sites) << kind << " \"" << text << '"';
}

struct BadParameters {
  const char* kind;
  const char* text;
  Status status;
  const char* words;
};

constexpr BadParameters kBad[]{
    {"vipc310", "0x6100", Status::badAddress,
     "I/O address 0x6100: use a multiple of 0x200, 0x0 to 0xfe00"},
    {"vipc310", "0x10000", Status::badAddress, "I/O address 0x10000"},
    {"vipc310", "0x6000,100", Status::badAddress, "memory size [K] 100"},
    {"vipc310", "0x6000,192", Status::badAddress, "memory size 192 K"},
    {"vipc310", "0x6000,4096", Status::badAddress,
     "memory size [K] 4096: use a multiple of 64, 0 to 2048"},
    {"vipc310", "0x6000,", Status::badAddress, "the memory size [K] is missing"},
    {"vipc310", "ipac", Status::badAddress, "the I/O address is not a number: \"ipac\""},
    {"vipc310", "0x6000,128,3", Status::badAddress, "\",3\" at the end has no meaning"},
    {"vipc610", "0xfe00", Status::badAddress, "I/O address 0xfe00"},
    {"vipc610", "-0x6000", Status::badAddress, "the I/O address is not a number"},
    {"vipc616", "0x6200", Status::badAddress, "a multiple of 0x400"},
    {"vipc616", "0x3000,0xa1000000", Status::badAddress,
     "memory address 0xa1000000: use a multiple of 0x2000000 in A32"},
    {"vipc616", "0x3000,D00000", Status::badAddress, "add a size [K] for A24"},
    {"vipc616_01", "0x6000,0xa0000000,128", Status::badAddress,
     "memory address 0xa0000000: use a multiple of 0x20000 in A24"},
    {"vipc616", "0x3000,0x123456789", Status::badAddress, "memory address 123456789"},
    {"ipmv162", "A:l=8", Status::badIntLevel, "interrupt level 8: use 1 to 7, or 0"},
    {"ipmv162", "A:l=3,9", Status::badIntLevel, "second interrupt level 9"},
    {"ipmv162", "A:l", Status::badAddress, "no '=' after the l"},
    {"ipmv162", "A:m=0xe0000000", Status::badAddress, "no ',' after the memory address"},
    {"ipmv162", "A:m=0xe0001000,64", Status::badAddress,
     "memory address 0xe0001000: use a multiple of 0x10000"},
    {"ipmv162", "A:m=0xe0000000,32", Status::badAddress, "memory size [K] 32"},
    {"ipmv162", "A:m=0xe0000000,32768", Status::badAddress, "64 to 16384"},
    {"ipmv162", "A:m=0xffe00000,2048", Status::badAddress, "the end is above 0xfff00000"},
    {"ipmv162", "A:m=0xe0000000,128;B:m=0xe0010000,64", Status::badAddress,
     "the memory of site B overlaps with that of site A"},
    {"ipmv162", "A:r=9", Status::badAddress, "recovery time [us] 9"},
    {"ipmv162", "A:w=24", Status::badAddress, "width 24: use 8, 16 or 32"},
    {"ipmv162", "B:w=32", Status::badAddress, "width 32 at site B"},
    {"tvme200", "", Status::badAddress, "six hexadecimal digits"},
    {"tvme200", "0x6010D0", Status::badAddress, "six hexadecimal digits"},
    {"tvme200", "6110D0", Status::badAddress, "switch S2 at 1: use 0, 4, 8 or C"},
    {"tvme200", "6050D0", Status::badIntLevel, "switch S3 at 5: use 0 to 4"},
    {"tvme200", "6018D0", Status::badAddress, "switch S4 at 8"},
    {"tvme200", "102670", Status::badAddress,
     "switches S5 and S6 at 70: 0x700000 is not a multiple of 0x400000"},
    {"hy8002", "", Status::badAddress, "the slot is missing"},
    {"hy8002", "22,2", Status::badAddress, "slot 22: use 0 to 21"},
    {"hy8002", "3", Status::badAddress, "no ',' after the slot"},
    {"hy8002", "3,8", Status::badIntLevel, "interrupt level 8"},
    {"hy8002", "3,2 IPMEM=3", Status::badAddress, "IPMEM 3: use 1, 2, 4 or 8"},
    {"hy8002", "3,2 IPMEM=4", Status::badAddress, "IPMEM 4 needs a MEMBASE"},
    {"hy8002", "16,2 IPMEM=2", Status::badAddress, "IPMEM 2 in slot 16 needs a MEMBASE"},
    {"hy8002", "3,2 IPMEM=4 MEMBASE=0x9080", Status::badAddress, "a multiple of 0x100"},
    {"hy8002", "3,2 MEMBASE=0x10000", Status::badAddress, "MEMBASE 0x10000"},
    {"hy8004", "3,2 IPCLK=16", Status::badAddress, "IPCLK 16: use 8 or 32"},
    {"hy8004", "3,2 ROAK=2", Status::badAddress, "ROAK 2"},
    {"hy8004", "3,2 CLOCK=8", Status::badAddress, "\"CLOCK=8\": use IPMEM, MEMBASE, IPCLK or ROAK"},
    {"xy9660", "0x6000", Status::badAddress, "no ',' after the I/O address"},
    {"xy9660", "0x6000,8", Status::badIntLevel, "interrupt level 8"},
    {"xy9660", "0x6000,4 E=1,800000", Status::badAddress,
     "\"E=1,800000\": use the sites A, B, C or D"},
    {"xy9660", "0x6000,4 A=3,800000", Status::badAddress, "memory size [M] 3"},
    {"xy9660", "0x6000,4 A=2,900000", Status::badAddress,
     "memory address 0x900000: use a multiple of 0x200000"},
    {"avme96xx", "0x6000,4 A=2,800000 B=1,900000", Status::badAddress,
     "the memory of site B overlaps with that of site A"},
    {"atc40", "0x1000,0x4000,11", Status::badAddress, "separate the parameters with blanks"},
    {"atc40", "0xa0000 512", Status::badAddress, "size [bytes] 512"},
    {"atc40", "0xa0000 0x4000 16", Status::badIntLevel, "interrupt request 16: use 0 to 15"},
    {"atc40", "0x1000000", Status::badAddress, "address 0x1000000"},
};

void expectRefused(const BadParameters& bad) {
  try {
    static_cast<void>(parseCarrierParameters(bad.kind, bad.text));
    ADD_FAILURE() << bad.kind << " \"" << bad.text << "\": no error";
  } catch (const IndustryPackError& error) {
    EXPECT_EQ(error.status(), bad.status) << toString(error.status()) << ": " << error.what();
    EXPECT_THAT(error.what(), HasSubstr(bad.words));
    EXPECT_THAT(error.what(), HasSubstr(fmt::format("\"{}\"", bad.text)));
  }
}

TEST(CarrierParametersTest, AreRefusedWithAnErrorThatNamesTheInvalidPart) {
  for (const auto& bad : kBad) expectRefused(bad);
}

TEST(CarrierParametersTest, GiveClockWidthResetAndAddressSpaces) {
  const auto hytec = parseCarrierParameters("hy8004", "3,2 IPCLK=32 ROAK=1");
  EXPECT_EQ(hytec.clockMHz, 32);
  EXPECT_TRUE(hytec.releasesOnAcknowledge);
  const auto motorola = parseCarrierParameters("ipmv162", "R C:w=8 r=4");
  EXPECT_TRUE(motorola.isReset);
  EXPECT_EQ(motorola.registers, BusSpace::local);
  EXPECT_EQ(motorola.sites[2].widthBits, 8);
  EXPECT_EQ(motorola.sites[2].recoveryUs, 4);
  EXPECT_TRUE(parseCarrierParameters("xy9660", "0,4 r").isReset);
  EXPECT_EQ(parseCarrierParameters("vipc616", "").memory, BusSpace::vmeA32);
  EXPECT_EQ(parseCarrierParameters("vipc616", "3000,D00000,64").memory, BusSpace::vmeA24);
}

TEST(CarrierParametersTest, OfAnUnknownKindAreRefused) {
  EXPECT_FALSE(isParameterKind("vipc999"));
  EXPECT_THROW(static_cast<void>(parseCarrierParameters("vipc999", "")), std::invalid_argument);
}

// The parameters of a carrier that MPF cannot reach are checked nevertheless, so that an error in
// an old startup file is found.
TEST(CreateCarrierTest, RefusesVmeAndIsaCarriersAndNamesTheAlternatives) {
  const auto problemOf = [](const char* kind, const char* parameters) {
    try {
      static_cast<void>(createCarrier(kind, parameters));
    } catch (const IndustryPackError& error) {
      return fmt::format("{}: {}", toString(error.status()), error.what());
    }
    return std::string("none");
  };
  const auto right = problemOf("&vipc616_01", "0x3000,0xa0000000");
  EXPECT_THAT(right, HasSubstr("S_IPAC_notImplemented: GreenSpring VIPC616-01"));
  EXPECT_THAT(right, HasSubstr("VME"));
  EXPECT_THAT(right, HasSubstr("tpci200"));
  EXPECT_THAT(right, HasSubstr("model"));
  EXPECT_THAT(problemOf("&vipc616_01", "0x3001"),
              HasSubstr("S_IPAC_badAddress: GreenSpring VIPC616-01 \"0x3001\""));
  EXPECT_THAT(problemOf("atc40", ""), HasSubstr("ISA"));
  EXPECT_THROW(static_cast<void>(createCarrier("vipc999", "")), std::invalid_argument);
}

}  // namespace
}  // namespace mpf::test
