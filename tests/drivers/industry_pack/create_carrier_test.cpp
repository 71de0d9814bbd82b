// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/create_carrier.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <stdexcept>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

#include "drivers/industry_pack/check_carrier.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

// "S_IPAC_badAddress: the message" of createCarrier(); "none" without an error.
std::string errorOfCreation(const char* kind, const char* parameters) {
  try {
    static_cast<void>(createCarrier(kind, parameters));
  } catch (const IndustryPackError& error) {
    return fmt::format("{}: {}", toString(error.status()), error.what());
  }
  return "none";
}

TEST(CreateCarrierTest, CreatesModelsWithFourSites) {
  const auto carrier = createCarrier("model", "");
  EXPECT_EQ(carrier->siteCount(), 4U);
  EXPECT_EQ(carrier->site(3).id().read16(0), 0xffff);
  EXPECT_THAT([] { static_cast<void>(createCarrier("model", "4")); },
              ThrowsMessage<std::invalid_argument>("carrier kind \"model\" has no parameters"));
}

TEST(CreateCarrierTest, ChecksTheParametersOfATpci200) {
  EXPECT_THAT(errorOfCreation("tpci200", "0,poll=0"), HasSubstr("S_IPAC_badAddress: "));
}

// The parameters of a carrier that MPF cannot reach are checked nevertheless, so that an error in
// an old startup file is found.
TEST(CreateCarrierTest, RefusesVmeAndIsaCarriersAndNamesTheAlternatives) {
  EXPECT_THAT(errorOfCreation("&vipc616_01", "0x3000,0xa0000000"),
              AllOf(HasSubstr("S_IPAC_notImplemented: GreenSpring VIPC616-01"), HasSubstr("VME"),
                    HasSubstr("tpci200"), HasSubstr("model")));
  EXPECT_THAT(errorOfCreation("&vipc616_01", "0x3001"),
              HasSubstr("S_IPAC_badAddress: GreenSpring VIPC616-01 \"0x3001\""));
  EXPECT_THAT(errorOfCreation("atc40", ""), HasSubstr("an ISA bus"));
}

TEST(CheckCarrierTest, ChecksWithoutTheBoard) {
  EXPECT_EQ(checkCarrier("model"), 4U);
  EXPECT_EQ(checkCarrier("tpci200:0000:ff:1f.7"), 4U);
  EXPECT_THROW(checkCarrier("model:4"), std::invalid_argument);
  EXPECT_THROW(checkCarrier("tpci200:0,poll=0"), IndustryPackError);
  EXPECT_THROW(checkCarrier("&vipc616_01:0x3000,0xa0000000"), IndustryPackError);
  EXPECT_THROW(checkCarrier("modle"), std::invalid_argument);
}

TEST(CreateCarrierTest, RefusesAnUnknownKindAndListsTheKinds) {
  EXPECT_THAT([] { static_cast<void>(createCarrier("vipc999", "")); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("unknown carrier kind \"vipc999\""), HasSubstr(carrierKinds()))));
  EXPECT_THAT(carrierKinds(), AllOf(HasSubstr("  model  four sites"),
                                    HasSubstr("  tpci200:[ADDRESS|NUMBER][,poll=US]  TEWS"),
                                    HasSubstr("vipc616_01")));
}

}  // namespace
}  // namespace mpf::test
