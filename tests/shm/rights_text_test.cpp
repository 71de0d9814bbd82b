// SPDX-License-Identifier: MIT
// RightsText: modes and groups as options name them.
#include "shm/rights_text.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <stdexcept>

#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

TEST(RightsText, AModeIsOctal) {
  EXPECT_EQ(parseMode("0600"), 0600u);
  EXPECT_EQ(parseMode("660"), 0660u);
  EXPECT_EQ(parseMode("0666"), 0666u);
}

class InvalidModes : public testing::TestWithParam<const char*> {};

TEST_P(InvalidModes, AreRefusedWithTheTextAndTheLimits) {
  EXPECT_THAT(whatOf<std::invalid_argument>([] { static_cast<void>(parseMode(GetParam())); }),
              testing::AllOf(testing::StartsWith(GetParam()), testing::HasSubstr("0600 and 0666")));
}
INSTANTIATE_TEST_SUITE_P(Each, InvalidModes,
                         testing::Values("", "0", "0400", "0066", "0777", "0680", "0600 ", "-0600",
                                         "77777777777777777777"));

class InvalidRights : public testing::TestWithParam<mode_t> {};

TEST_P(InvalidRights, AreRefusedWithTheModeAndTheValidBits) {
  EXPECT_THAT(whatOf<std::invalid_argument>([] { checkServerRights({.mode = GetParam()}); }),
              testing::AllOf(testing::StartsWith(fmt::format("mode {:#o} ", GetParam())),
                             testing::HasSubstr("0666"), testing::HasSubstr("0600")));
}
INSTANTIATE_TEST_SUITE_P(Each, InvalidRights, testing::Values(0, 0111, 0400, 0066, 07777, 660));

TEST(RightsText, AServerBelongsToItsOwnUser) {
  EXPECT_THAT(whatOf<std::invalid_argument>([] { checkServerRights({.user = 65534}); }),
              testing::StartsWith("user 65534 "));
  EXPECT_EQ(checkServerRights({.mode = 0660, .group = 7}), (Rights{.mode = 0660, .group = 7}));
}

TEST(RightsText, AGroupIsFoundByItsName) { EXPECT_EQ(parseGroup("root"), 0u); }

TEST(RightsText, RightsAreOfAModeAndAGroup) {
  EXPECT_EQ(Rights::of("0660", "root"), (Rights{.mode = 0660, .group = 0}));
  EXPECT_THAT(whatOf<std::invalid_argument>([] { static_cast<void>(Rights::of("0770", "root")); }),
              testing::StartsWith("0770: "));
  EXPECT_THAT(
      whatOf<std::invalid_argument>([] { static_cast<void>(Rights::of("0660", "nobodys")); }),
      testing::StartsWith("nobodys: "));
}

TEST(RightsText, AnUnknownGroupIsNamed) {
  EXPECT_THAT(
      whatOf<std::invalid_argument>([] { static_cast<void>(parseGroup("no-such-group-of-mpf")); }),
      testing::HasSubstr("no-such-group-of-mpf"));
}

}  // namespace
}  // namespace mpf::test
