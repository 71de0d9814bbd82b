// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/open_bus.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/stop_bell.h"
#include "tests/server/programs/command_line.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class OpenBusTest : public testing::Test {
 protected:
  void parse(const std::vector<std::string>& words) {
    const auto status =
        statusOf([&](int argc, char** argv) { return options_.parse(argc, argv); }, words);
    ASSERT_EQ(status, std::nullopt);
  }

  Watchdog watchdog_{"open bus test"};
  ServerLog log_{"test", "off"};
  GpibStartOptions options_;
  StopBell stop_;
};

TEST_F(OpenBusTest, AModelOfAModuleHasAMeter) {
  parse({"GPIB0", "a-ip488", "--ti9914", "a-ip488,ipac,IP_a,105", "--carrier", "ipac=model"});

  const auto bus = openBus(options_, log_, stop_);

  ASSERT_NE(bus, nullptr);
  const auto reading = bus->read({22}, {.maxBytes = 100}, Deadline::after(60s));
  EXPECT_EQ(std::string(reading.data.begin(), reading.data.end()), "-8.874270409E-01\r\n")
      << reading.reason;
}

TEST_F(OpenBusTest, AnUnknownControllerIsAnError) {
  parse({"GPIB0", "nowhere"});
  try {
    static_cast<void>(openBus(options_, log_, stop_));
    ADD_FAILURE() << "it was opened";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("nowhere"),
                      HasSubstr("linux-gpib:0; or the MODULE of --ti9914 MODULE,CARRIER,SITE")));
  }
}

}  // namespace
}  // namespace mpf::test
