// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart_settings.h"

#include <stdexcept>

#include "drivers/octal_uart/scc2698b.h"
#include "octal_uart_fixture.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class OctalUartSettingsTest : public OctalUartTest {};

// The register values that the old driver wrote for each speed of the manual.
TEST_F(OctalUartSettingsTest, TheManualsSpeedsHaveTheCodesOfTheOldDriver) {
  const std::map<int, std::uint8_t> codes{{1200, 0x66}, {2400, 0x88},  {4800, 0x99},
                                          {9600, 0xbb}, {19200, 0xcc}, {38400, 0x22}};
  for (const auto& [baud, csr] : codes)
    EXPECT_EQ(octalUartModeOf({baud, 1, 8, 'N', 'N'}).csr, csr) << baud;
}

TEST_F(OctalUartSettingsTest, ModesHaveTheValuesOfTheOldDriver) {
  EXPECT_EQ(octalUartModeOf({9600, 1, 8, 'N', 'N'}), (OctalUartMode{0x13, 0x07, 0xbb}));
  EXPECT_EQ(octalUartModeOf({9600, 2, 7, 'E', 'N'}), (OctalUartMode{0x02, 0x0f, 0xbb}));
  EXPECT_EQ(octalUartModeOf({9600, 1, 5, 'O', 'H'}), (OctalUartMode{0x84, 0x17, 0xbb}));
}

TEST_F(OctalUartSettingsTest, EverySettingReachesTheChip) {
  const auto port = openOctalUartPort(start(), 5, {});

  for (const int baud : scc2698b::kBauds) {
    for (const char parity : {'E', 'O', 'N'}) {
      for (const int stopBits : {1, 2}) {
        for (const int bits : {5, 6, 7, 8}) {
          for (const char flow : {'H', 'N'}) {
            const SerialSettings settings{baud, stopBits, bits, parity, flow};
            ASSERT_EQ(port->config(settings), "");
            ASSERT_EQ(settingsInChip(5), settings);
          }
        }
      }
    }
  }
}

TEST_F(OctalUartSettingsTest, ZeroMeansTheUsualSetting) {
  const auto port = openOctalUartPort(start(), 0, {.settings = {.baud = 19200}});

  EXPECT_EQ(settingsInChip(0), (SerialSettings{19200, 1, 8, 'N', 'N'}));
}

// The old driver used 19200 instead, and reported no error.
TEST_F(OctalUartSettingsTest, AnUnsupportedSpeedIsNamedAndChangesNothing) {
  const auto port = openOctalUartPort(start(), 0, {.settings = kFast});

  EXPECT_EQ(port->config({.baud = 57600, .parity = 'E'}),
            "baud 57600: the chip supports 75, 110, 150, 300, 600, 1200, 1800, 2000, 2400, 4800, "
            "9600, 19200, 38400");

  EXPECT_EQ(settingsInChip(0), kFast);
}

TEST_F(OctalUartSettingsTest, OpeningAPortWithAnUnsupportedSpeedIsRefused) {
  auto& uart = start();
  try {
    const auto port = openOctalUartPort(uart, 3, {.settings = {.baud = 115200}});
    FAIL() << "no error";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("port 3 of UART (carrier ipac, site IP_a): baud 115200: "));
  }

  const auto port = openOctalUartPort(uart, 3, {});  // the failed attempt has not reserved the port
}

TEST_F(OctalUartSettingsTest, Rs485HasNoHardwareFlowControl) {
  const auto port = openOctalUartPort(start({.model = 0x48}), 0, {});

  EXPECT_THAT(port->config({.flowControl = 'H'}), HasSubstr("flow control 'H'"));
}

TEST_F(OctalUartSettingsTest, TheTimeOfAByteIncludesAllItsBits) {
  EXPECT_EQ(byteTime({9600, 1, 8, 'N', 'N'}).count(), 1'041'666);
  EXPECT_EQ(byteTime({1200, 2, 7, 'E', 'N'}).count(), 9'166'666);
}

}  // namespace
}  // namespace mpf::test
