// SPDX-License-Identifier: MIT
#include <mpf/drivers/gpib/open_gpib_controller.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>

namespace mpf::test {
namespace {

using testing::HasSubstr;

std::string whyNotOpened(std::string_view text) {
  try {
    static_cast<void>(openGpibController(text));
  } catch (const std::exception& error) {
    return error.what();
  }
  return "it was opened";
}

TEST(OpenGpibController, OpensEachForm) {
  EXPECT_EQ(openGpibController("prologix:localhost:1")->description(), "Prologix at localhost:1");
  EXPECT_EQ(openGpibController("prologix:/dev/absent")->description(), "Prologix at /dev/absent");
  EXPECT_EQ(openGpibController("usbtmc:/dev/absent")->description(),
            "USB instrument at /dev/absent");
}

TEST(OpenGpibController, NamesTheTextAndTheForms) {
  for (const auto* const text : {"", "prologix", "prologix:", "prologix:host", "toaster:/dev/x",
                                 "usbtmc:", "linux-gpib:x", "linux-gpib:16", "linux-gpib:0x"}) {
    const auto why = whyNotOpened(text);
    EXPECT_THAT(why, HasSubstr("\"" + std::string(text) + "\""));
    EXPECT_THAT(why, HasSubstr("usbtmc:/dev/usbtmc0"));
  }
}

}  // namespace
}  // namespace mpf::test
