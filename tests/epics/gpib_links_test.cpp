// SPDX-License-Identifier: MIT
#include "epics/gpib_links.h"

#include <gmock/gmock.h>
#include <stdexcept>

namespace mpf::test {
namespace {

TEST(GpibLinks, KeepTheFirstServerOfALink) {
  GpibLinks links;
  links.add(10, {1, "GPIB0"});
  links.add(10, {1, "GPIB0"});

  EXPECT_THAT([&] { links.add(10, {0, "GPIB0"}); },
              testing::ThrowsMessage<std::invalid_argument>(
                  "GPIB link 10 is \"GPIB0\" at location 1 already"));
  EXPECT_EQ(links.find(10), (GpibLink{1, "GPIB0"}));
  EXPECT_FALSE(links.find(11));
}

TEST(GpibLinks, RefuseAnInvalidName) {
  GpibLinks links;

  EXPECT_THROW(links.add(1, {0, ""}), std::invalid_argument);
  EXPECT_FALSE(links.find(1));
}

}  // namespace
}  // namespace mpf::test
