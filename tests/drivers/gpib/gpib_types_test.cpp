// SPDX-License-Identifier: MIT
#include <mpf/drivers/gpib/gpib_types.h>

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

TEST(GpibTypes, ReadsNumbersFrom0To30AsPrimaryAddresses) {
  EXPECT_EQ(GpibAddress::fromNumber(0), GpibAddress{0});
  EXPECT_EQ(GpibAddress::fromNumber(22), GpibAddress{22});
  EXPECT_EQ(GpibAddress::fromNumber(30), GpibAddress{30});
}

TEST(GpibTypes, ReadsNumbersFrom100AsPrimaryAndSecondaryAddresses) {
  EXPECT_EQ(GpibAddress::fromNumber(100), (GpibAddress{1, 0}));
  EXPECT_EQ(GpibAddress::fromNumber(2205), (GpibAddress{22, 5}));
  EXPECT_EQ(GpibAddress::fromNumber(3030), (GpibAddress{30, 30}));
}

TEST(GpibTypes, RefusesNumbersThatAreNoAddress) {
  for (const int number : {-2147483647 - 1, -1, 31, 99, 131, 2231, 3031, 3100, 2147483647})
    EXPECT_EQ(GpibAddress::fromNumber(number), std::nullopt) << number;
}

TEST(GpibTypes, GivesEachNumberBack) {
  for (const int number : {0, 1, 30, 100, 130, 2205, 3030})
    EXPECT_EQ(GpibAddress::fromNumber(number)->number(), number);
  EXPECT_EQ((GpibAddress{0, 5}.number()), 0) << "it has no number";
}

TEST(GpibTypes, RefusesPartsAbove30) {
  EXPECT_TRUE((GpibAddress{30, 30}.isValid()));
  EXPECT_FALSE(GpibAddress{31}.isValid());
  EXPECT_FALSE((GpibAddress{30, 31}.isValid()));
}

TEST(GpibTypes, ShowsAddressesAsPeopleWriteThem) {
  EXPECT_EQ(toString(GpibAddress{22}), "22");
  EXPECT_EQ(toString(GpibAddress{22, 5}), "22.5");
}

TEST(GpibTypes, NamesEachStatus) {
  EXPECT_STREQ(toString(GpibStatus::success), "success");
  EXPECT_STREQ(toString(GpibStatus::timeout), "timeout");
  EXPECT_STREQ(toString(GpibStatus::noListener), "no listener");
  EXPECT_STREQ(toString(GpibStatus::failure), "failure");
  EXPECT_STREQ(toString(GpibStatus::unsupported), "unsupported");
  EXPECT_STREQ(toString(GpibStatus::leased), "leased");
  EXPECT_STREQ(toString(static_cast<GpibStatus>(99)), "invalid status");
}

}  // namespace
}  // namespace mpf::test
