// SPDX-License-Identifier: MIT
#include "drivers/digital_io/digital_io_kind.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

TEST(DigitalIoKind, KnowsAllModels) {
  EXPECT_EQ(digitalIoKinds().size(), 18u);
  for (const auto& kind : digitalIoKinds()) {
    EXPECT_EQ(findDigitalIoKind(kind.manufacturer, kind.model), &kind);
    EXPECT_EQ(findDigitalIoKind(kind.name), &kind);
    EXPECT_EQ(kind.hasInterrupts,
              kind.name.find("-I-") != std::string_view::npos || kind.name.ends_with("-I"))
        << kind.name;
    EXPECT_EQ(kind.hasThreshold, kind.name.find("HV") != std::string_view::npos) << kind.name;
  }
  EXPECT_EQ(findDigitalIoKind(kGreenSpring, 0x6d), nullptr);  // a timer
  EXPECT_EQ(findDigitalIoKind("IP-Unidig-T"), nullptr);
}

TEST(DigitalIoModules, AreAllModelsByManufacturer) {
  const auto modules = digitalIoModules();
  EXPECT_EQ(modules.manufacturer, kGreenSpring);
  EXPECT_EQ(modules.models.size(), 17u);
  ASSERT_EQ(modules.others.size(), 1u);
  EXPECT_EQ(modules.others.front().manufacturer, kSystran);
  EXPECT_THAT(modules.others.front().models, testing::ElementsAre(0x63));
}

}  // namespace
}  // namespace mpf::test
