// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/carrier.h>

#include <gmock/gmock.h>
#include <stdexcept>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

#include "tests/support/model_carrier.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(CarriersTest, AreFoundByNameWithTheirSites) {
  IndustryPackCarriers carriers;
  auto& second = addModelCarrier(carriers, "second");
  auto& first = addModelCarrier(carriers, "first");

  EXPECT_EQ(&carriers.find("first"), &first);
  EXPECT_EQ(&carriers.site("first", "IP_a"), &first.site(0));
  EXPECT_EQ(&carriers.site("second", "IP_d"), &second.site(3));
  EXPECT_THAT(carriers.names(), ElementsAre("first", "second"));
}

TEST(CarriersTest, ThatDoNotExistAreNamedWithTheExistingOnes) {
  IndustryPackCarriers carriers;
  addModelCarrier(carriers, "one");
  addModelCarrier(carriers, "two");

  EXPECT_THAT([&] { static_cast<void>(carriers.find("three")); },
              ThrowsMessage<std::invalid_argument>("no carrier \"three\"; carriers: one, two"));
  EXPECT_THAT([&] { static_cast<void>(carriers.site("one", "IP_e")); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("carrier \"one\" (a model carrier) has no site \"IP_e\""),
                        HasSubstr("it has IP_a to IP_d"))));
  EXPECT_THROW(static_cast<void>(carriers.site("three", "IP_a")), std::invalid_argument);
}

TEST(CarriersTest, NeedANameThatIsNotInUse) {
  IndustryPackCarriers carriers;
  auto& first = addModelCarrier(carriers, "ipac");

  EXPECT_THROW(carriers.add("", std::make_unique<ModelCarrier>()), std::invalid_argument);
  EXPECT_THAT([&] { carriers.add("ipac", std::make_unique<ModelCarrier>()); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("carrier \"ipac\" exists already: a model carrier")));

  EXPECT_EQ(&carriers.find("ipac"), &first);
}

TEST(CarriersTest, AreLimitedToTwentyOne) {
  IndustryPackCarriers carriers;
  for (int i = 0; i < 21; ++i) addModelCarrier(carriers, "ipac" + std::to_string(i));
  EXPECT_THROW(addModelCarrier(carriers, "ipac0"), std::invalid_argument);
  try {
    addModelCarrier(carriers, "ipac21");
    FAIL() << "no error";
  } catch (const IndustryPackError& error) {
    EXPECT_EQ(error.status(), IndustryPackStatus::tooMany);
  }
  EXPECT_EQ(carriers.names().size(), 21U);
}

TEST(SiteNameTest, HasALetterForEachNumber) {
  EXPECT_EQ(siteName(0), "IP_a");
  EXPECT_EQ(siteName(3), "IP_d");
}

}  // namespace
}  // namespace mpf::test
