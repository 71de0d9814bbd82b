// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/carrier_parameters.h"

#include <gmock/gmock.h>
#include <stdexcept>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(CarrierParametersTest, AreOfAKindThatASymbolOrACommandOfDrvIpacNames) {
  for (const auto* const kind :
       {"vipc616_01", "&vipc616_01", "VIPC616_01", "ipacAddVIPC616_01", "&ipacaddvipc616_01"}) {
    EXPECT_TRUE(isParameterKind(kind)) << kind;
    EXPECT_EQ(parseCarrierParameters(kind, "").board, "GreenSpring VIPC616-01") << kind;
  }
  for (const auto* const kind : {"", "&", "ipacAdd", "vipc999", "vipc616_0", "model", "tpci200"})
    EXPECT_FALSE(isParameterKind(kind)) << kind;
}

TEST(CarrierParametersTest, HaveAParserForEachKind) {
  const auto kinds = parameterKinds();
  EXPECT_THAT(kinds, testing::IsSupersetOf({"vipc310", "ipmv162", "tvme200", "hy8002", "atc40"}));
  for (const auto& kind : kinds) {
    EXPECT_TRUE(isParameterKind(kind)) << kind;
    try {
      EXPECT_FALSE(parseCarrierParameters(kind, "").sites.empty()) << kind;
    } catch (const IndustryPackError& error) {
      EXPECT_EQ(error.status(), IndustryPackStatus::badAddress) << error.what();
    }
  }
}

TEST(CarrierParametersTest, OfAnUnknownKindAreRefusedWithTheKnownKinds) {
  EXPECT_THAT([] { static_cast<void>(parseCarrierParameters("vipc999", "")); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("unknown carrier kind \"vipc999\""), HasSubstr("vipc310, "))));
}

TEST(CarrierParametersTest, MustBeUsedUpByTheParser) {
  EXPECT_THAT([] { static_cast<void>(parseCarrierParameters("vipc310", "0x6000,128 extra")); },
              ThrowsMessage<IndustryPackError>(
                  AllOf(HasSubstr("GreenSpring VIPC310"), HasSubstr("\"extra\" at the end"))));
}

}  // namespace
}  // namespace mpf::test
