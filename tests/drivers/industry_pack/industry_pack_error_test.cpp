// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/industry_pack_error.h>

#include <array>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

// The names in drvIpac.h, by number from 1.
constexpr std::array kNamesOfDrvIpac{
    "S_IPAC_badTable",       "S_IPAC_tooMany",   "S_IPAC_badAddress",  "S_IPAC_badDriver",
    "S_IPAC_noModule",       "S_IPAC_noIpacId",  "S_IPAC_badCRC",      "S_IPAC_badModule",
    "S_IPAC_notImplemented", "S_IPAC_badVector", "S_IPAC_vectorInUse", "S_IPAC_badIntLevel"};

TEST(IndustryPackStatusTest, HasTheNumbersAndNamesOfDrvIpac) {
  for (std::size_t i = 0; i < kNamesOfDrvIpac.size(); ++i)
    EXPECT_STREQ(toString(static_cast<IndustryPackStatus>(i + 1)), kNamesOfDrvIpac.at(i));
}

TEST(IndustryPackStatusTest, HasANameForEachOtherNumber) {
  for (const unsigned number : {0U, 13U, 255U})
    EXPECT_STREQ(toString(static_cast<IndustryPackStatus>(number)), "S_IPAC_unknown");
}

}  // namespace
}  // namespace mpf::test
