// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/ti9914_options.h"

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/stop_bell.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

struct ParsedTi9914 {
  explicit ParsedTi9914(const std::string& line) {
    CLI::App app;
    options.addTo(app);
    hardware.addTo(app);
    app.parse(line);
  }
  std::unique_ptr<GpibController> open(const std::string& module) {
    return openTi9914(options, *options.find(module), hardware, log, stop);
  }
  Ti9914Options options;
  Hardware hardware;
  ServerLog log{"test", "off"};
  StopBell stop;
};

std::string refusalOfTi9914(const std::string& line) {
  try {
    const ParsedTi9914 parsed(line);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return {};
}

std::string readLineFrom(GpibController& gpib, const GpibAddress& from) {
  const auto result = gpib.read(from, {.maxBytes = 100}, Deadline::never());
  EXPECT_TRUE(result.ok()) << result.reason;
  return {result.data.begin(), result.data.end()};
}

TEST(Ti9914Options, AModuleHasThePlaceAndTheVectorOfItsFields) {
  const ParsedTi9914 parsed("--ti9914 a-ip488,ipac,IP_a,104 --ti9914 b-ip488,ipac,IP_b");

  const auto* const first = parsed.options.find("a-ip488");
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->place.carrier, "ipac");
  EXPECT_EQ(first->place.site, "IP_a");
  EXPECT_EQ(first->vector, 104);
  EXPECT_EQ(parsed.options.find("b-ip488")->vector, std::nullopt);
  EXPECT_EQ(parsed.options.find("c-ip488"), nullptr);
}

TEST(Ti9914Options, AModelHasAMeterAtItsUsualAddress) {
  const Watchdog watchdog("TI9914 options test");
  ParsedTi9914 parsed("--ti9914 a-ip488,ipac,IP_a,104 --carrier ipac=model");

  const auto gpib = parsed.open("a-ip488");

  EXPECT_EQ(readLineFrom(*gpib, {22}), "-8.874270409E-01\r\n");
}

TEST(Ti9914Options, AModelHasTheMetersOfItsOptionsAndTheirWires) {
  const Watchdog watchdog("TI9914 options test");
  const TemporaryFolder folder;
  ParsedTi9914 parsed(
      "--ti9914 a-ip488,ipac,IP_a --carrier ipac=model --meter 5 --meter 603,dac.0 --wires " +
      folder.file("wires"));
  const auto gpib = parsed.open("a-ip488");
  parsed.hardware.wires()->wire("dac.0").set(2.5);

  EXPECT_EQ(readLineFrom(*gpib, {5}), "-8.874270409E-01\r\n");
  EXPECT_EQ(readLineFrom(*gpib, {6, 3}), " 2.500000000E+00\r\n");
}

TEST(Ti9914Options, RefuseInvalidFields) {
  EXPECT_THAT(refusalOfTi9914("--ti9914 a,ipac"), HasSubstr("site is missing"));
  EXPECT_THAT(refusalOfTi9914("--ti9914 a,ipac,IP_a,x"), HasSubstr("is not a whole number"));
  EXPECT_THAT(refusalOfTi9914("--ti9914 a,ipac,IP_a,1,2"), HasSubstr("unexpected field \"2\""));
  EXPECT_THAT(refusalOfTi9914("--meter 31"), HasSubstr("31 is not a GPIB address"));
}

TEST(Ti9914Options, AWireNeedsTheFileOfTheWires) {
  ParsedTi9914 parsed("--ti9914 a,ipac,IP_a --carrier ipac=model --meter 5,dac.0");
  EXPECT_THROW(static_cast<void>(parsed.open("a")), std::invalid_argument);
}

}  // namespace
}  // namespace mpf::test
