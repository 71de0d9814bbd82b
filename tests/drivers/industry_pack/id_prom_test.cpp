// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/id_prom.h>

#include <gtest/gtest.h>

#include <mpf/drivers/industry_pack/industry_pack_error.h>
#include <mpf/drivers/industry_pack/memory_registers.h>

#include "plain_model.h"

namespace mpf::test {
namespace {

struct CrcVector {
  const char* name;
  std::uint8_t manufacturer;
  std::uint8_t model;
  std::uint8_t crc;
};

class IdPromCrc : public testing::TestWithParam<CrcVector> {};

TEST_P(IdPromCrc, MatchesTheCrcOfTheModule) {
  const auto& [name, manufacturer, model, crc] = GetParam();
  EXPECT_EQ(wordsOf({.manufacturer = manufacturer, .model = model}).at(11), crc);
}

// The CRCs that the standard defines for 12 bytes with revision, reserved and driver 0.
INSTANTIATE_TEST_SUITE_P(
    Known, IdPromCrc,
    testing::Values(CrcVector{"Ip330", 0xa3, 0x11, 0x5a}, CrcVector{"Octal232", 0xf0, 0x22, 0x44},
                    CrcVector{"Octal422", 0xf0, 0x2a, 0xe9},
                    CrcVector{"Octal485", 0xf0, 0x48, 0x10}, CrcVector{"Ip488", 0xf0, 0x14, 0xec},
                    CrcVector{"Dac128v", 0x45, 0x69, 0x64}, CrcVector{"Unidig", 0xf0, 0x61, 0x2a},
                    CrcVector{"UnidigI", 0xf0, 0x68, 0xe6}, CrcVector{"Dio316i", 0x45, 0x63, 0x2a}),
    [](const auto& known) { return std::string(known.param.name); });

class IdPromTest : public testing::Test {
 protected:
  Registers& space(const IdProm& prom) {
    carrier_.plug("IP_a", std::make_unique<PlainModel>(prom));
    return carrier_.site(0).id();
  }
  ModelCarrier carrier_;
};

TEST_F(IdPromTest, OfFormatOneIsReadBack) {
  const IdProm prom{.manufacturer = 0xf0, .model = 0x22, .revision = 3, .driverId = 0x1234};
  EXPECT_EQ(readIdProm(space(prom), "IP_a"), prom);
}

TEST_F(IdPromTest, OfFormatOneMayRunAt32MHz) {
  const IdProm prom{.runsAt32MHz = true, .manufacturer = 0xf0, .model = 0x22};
  EXPECT_TRUE(readIdProm(space(prom), "IP_a").runsAt32MHz);
}

TEST_F(IdPromTest, OfFormatTwoIsReadBack) {
  const IdProm prom{.format = IdProm::Format::two,
                    .manufacturer = 0x0080a3,
                    .model = 0x1234,
                    .revision = 1,
                    .driverId = 0x10002,
                    .flags = 2,
                    .bytesUsed = 26};
  EXPECT_EQ(readIdProm(space(prom), "IP_a"), prom);
}

TEST_F(IdPromTest, ReportsAWrongCrc) {
  EXPECT_FALSE(
      readIdProm(space({.manufacturer = 0xf0, .model = 0x22, .hasValidCrc = false}), "IP_a")
          .hasValidCrc);
}

TEST_F(IdPromTest, ReportsAWrongCrcOfFormatTwo) {
  EXPECT_FALSE(readIdProm(space({.format = IdProm::Format::two,
                                 .manufacturer = 1,
                                 .bytesUsed = 26,
                                 .hasValidCrc = false}),
                          "IP_a")
                   .hasValidCrc);
}

TEST_F(IdPromTest, WithMoreBytesUsedThanExistHasAWrongCrc) {
  const IdProm prom{.manufacturer = 0xf0, .model = 0x22, .bytesUsed = 255};
  EXPECT_FALSE(readIdProm(space(prom), "IP_a").hasValidCrc);
}

TEST_F(IdPromTest, IsRefusedWhenNothingAnswers) {
  try {
    static_cast<void>(readIdProm(carrier_.site(1).id(), "carrier ipac, site IP_b"));
    FAIL();
  } catch (const IndustryPackError& error) {
    EXPECT_EQ(error.status(), IndustryPackStatus::noModule);
    EXPECT_STREQ(error.what(), "no module at carrier ipac, site IP_b");
  }
}

TEST_F(IdPromTest, IsRefusedWhenTheContentsAreNotAnIdProm) {
  std::array<std::uint16_t, 64> zeroes{};
  MemoryRegisters memory(zeroes.data(), sizeof(zeroes));
  try {
    static_cast<void>(readIdProm(memory, "IP_a"));
    FAIL();
  } catch (const IndustryPackError& error) {
    EXPECT_EQ(error.status(), IndustryPackStatus::noIpacId);
  }
}

}  // namespace
}  // namespace mpf::test
