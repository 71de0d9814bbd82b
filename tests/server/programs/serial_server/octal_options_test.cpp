// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/octal_options.h"

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

void parseInto(OctalOptions& options, const std::string& line) {
  CLI::App app;
  options.addTo(app);
  app.parse(line);
}

std::string refusalOf(const std::string& line) {
  OctalOptions options;
  try {
    parseInto(options, line);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return {};
}

TEST(OctalOptions, AModuleHasThePlaceThePortsAndTheVectorOfItsFields) {
  OctalOptions options;
  parseInto(options, "--octal-uart U,ipac,IP_a,4,100 --octal-uart V,ipac,IP_b,8");

  ASSERT_THAT(options.uarts, SizeIs(2));
  const auto* const first = options.findUart("U");
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->place.carrier, "ipac");
  EXPECT_EQ(first->place.site, "IP_a");
  EXPECT_EQ(first->ports, 4);
  EXPECT_EQ(first->vector, 100);
  EXPECT_EQ(options.findUart("V")->vector, std::nullopt);
  EXPECT_EQ(options.findUart("W"), nullptr);
}

TEST(OctalOptions, SettingsThatAreLeftOutHaveTheirDefaults) {
  OctalOptions options;
  parseInto(options, "--octal-port a,U,0 --octal-port b,U,7,19200,E,2,7,H --octal-port c,U,1,,O");

  EXPECT_EQ(options.find("a")->settings, (SerialSettings{9600, 1, 8, 'N', 'N'}));
  EXPECT_EQ(options.find("b")->module, "U");
  EXPECT_EQ(options.find("b")->number, 7);
  EXPECT_EQ(options.find("b")->settings, (SerialSettings{19200, 2, 7, 'E', 'H'}));
  EXPECT_EQ(options.find("c")->settings, (SerialSettings{9600, 1, 8, 'O', 'N'}));
  EXPECT_EQ(options.find("d"), nullptr);
}

TEST(OctalOptions, AModelIsAnOctal232UnlessAnotherIsChosen) {
  constexpr std::uint16_t kOctal232 = 0x22;
  constexpr std::uint16_t kOctal422 = 0x2a;
  constexpr std::uint16_t kOctal485 = 0x48;
  for (const auto& [line, model] :
       {std::pair("", kOctal232), std::pair("--octal-model 232", kOctal232),
        std::pair("--octal-model 422", kOctal422), std::pair("--octal-model 485", kOctal485)}) {
    OctalOptions options;
    parseInto(options, line);
    EXPECT_EQ(options.model.model, model) << line;
    EXPECT_TRUE(options.model.terminals) << line;
  }
}

TEST(OctalOptions, AModelTakesTimeOnlyOnRequest) {
  OctalOptions instant;
  OctalOptions timed;
  parseInto(instant, "");
  parseInto(timed, "--octal-timing");

  EXPECT_EQ(instant.model.time, OctalUartModelTime::instant);
  EXPECT_EQ(timed.model.time, OctalUartModelTime::clock);
}

TEST(OctalOptions, RefuseInvalidFields) {
  EXPECT_THAT(refusalOf("--octal-uart U,ipac"), HasSubstr("site is missing"));
  EXPECT_THAT(refusalOf("--octal-uart U,ipac,IP_a,many"),
              HasSubstr("number of ports \"many\" is not a whole number"));
  EXPECT_THAT(refusalOf("--octal-port a,U"), HasSubstr("number of the port is missing"));
  EXPECT_THAT(refusalOf("--octal-port a,U,0,9600,none"),
              HasSubstr("parity \"none\" is not one letter"));
  EXPECT_THAT(refusalOf("--octal-port a,U,0,9600,N,1,8,N,more"),
              HasSubstr("unexpected field \"more\""));
  EXPECT_THAT(refusalOf("--octal-model 423"), HasSubstr("423 not in"));
}

}  // namespace
}  // namespace mpf::test
