// SPDX-License-Identifier: MIT
// Carriers, modules and models that programs open, and what --wait waits for.
#include "server/programs/hardware/hardware.h"

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <stdexcept>

#include "tests/drivers/industry_pack/plain_model.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class HardwareOpenTest : public testing::Test {
 protected:
  void parse(const std::string& options) {
    CLI::App app;
    hardware_.addTo(app);
    app.parse(options);
  }
  IndustryPackModule* open(const Hardware::MakeModel& makeModel) {
    const ServerLog log("test", "warning");
    return hardware_.open({.name = "dac", .carrier = "ipac", .site = "IP_a"},
                          {.name = "plain", .manufacturer = 0xa3, .models = {0x11}}, makeModel,
                          log);
  }

  Watchdog watchdog_{"hardware test"};
  TemporaryFolder folder_;
  Hardware hardware_;
};

TEST_F(HardwareOpenTest, ContinuesWhenTheBoardAppearsAndLogsEachReasonOnce) {
  parse("--carrier ipac=model --wait");
  int calls = 0;
  testing::internal::CaptureStderr();

  const auto* const module = open([&] {
    if (++calls <= 2) throw std::runtime_error("no power");
    if (calls == 3) throw std::runtime_error("no clock");
    return std::make_unique<PlainModel>();
  });

  const auto said = testing::internal::GetCapturedStderr();
  EXPECT_NE(module, nullptr);
  EXPECT_EQ(calls, 4);
  const auto first = said.find("waiting for the board: no power");
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("no power", first + 40), std::string::npos) << said;
  EXPECT_THAT(said, HasSubstr("waiting for the board: no clock"));
}

TEST_F(HardwareOpenTest, DoesNotWaitWithoutTheOptionWait) {
  parse("--carrier ipac=model");
  int calls = 0;
  const Hardware::MakeModel none = [&]() -> std::unique_ptr<DeviceModel> {
    ++calls;
    throw std::runtime_error("no power");
  };
  EXPECT_THROW(static_cast<void>(open(none)), std::runtime_error);
  EXPECT_EQ(calls, 1);
}

// The program would otherwise wait without end.
TEST_F(HardwareOpenTest, DoesNotWaitWhenTheFileOfWiresIsInvalid) {
  parse("--carrier ipac=model --wait --wires " + folder_.write("letter", "a letter"));
  EXPECT_ANY_THROW(static_cast<void>(open([&] {
    static_cast<void>(hardware_.wires());
    return std::make_unique<PlainModel>();
  })));
}

}  // namespace
}  // namespace mpf::test
