// SPDX-License-Identifier: MIT
#include "epics/devices/string_parm/value_format.h"

#include <gtest/gtest.h>
#include <limits>
#include <stdexcept>

namespace mpf::test {
namespace {

using Long = ValueFormat<std::int32_t>;
using Double = ValueFormat<double>;

std::string print(std::string_view format, double value) {
  return Double(format, FormatUse::print).print(value);
}
std::string printLong(std::string_view format, std::int32_t value) {
  return Long(format, FormatUse::print).print(value);
}
std::optional<double> scan(std::string_view format, const std::string& text) {
  return Double(format, FormatUse::scan).scan(text);
}
std::optional<std::int32_t> scanLong(std::string_view format, const std::string& text) {
  return Long(format, FormatUse::scan).scan(text);
}

TEST(ValueFormat, PrintsAsPrintf) {
  EXPECT_EQ(print("SOUR:VOLT %4.3lf", 1.5), "SOUR:VOLT 1.500");
  EXPECT_EQ(print("V%.2f%%", 1.5), "V1.50%");
  EXPECT_EQ(print("%-8g|", 1.5), "1.5     |");
  EXPECT_EQ(print("RESET", 1.5), "RESET");
  EXPECT_EQ(print("%.3f", 1e300).size(), 305U);
  EXPECT_EQ(printLong("F3C%1d", -2), "F3C-2");
  EXPECT_EQ(printLong("%ld", 5), "5");
  EXPECT_EQ(printLong("%04lX", -1), "FFFFFFFF");
  EXPECT_EQ(printLong("%c", 'a'), "a");
}

TEST(ValueFormat, ScansAsScanf) {
  EXPECT_EQ(scan("%lf", "1.5 V"), 1.5);
  EXPECT_EQ(scan("%f", "1.5"), 1.5);
  EXPECT_EQ(scan("T=%lf", "T=-2e3"), -2000);
  EXPECT_EQ(scan("T=%lf", "U=1"), std::nullopt);
  EXPECT_EQ(scan("%*[^0-9]%lf", "abc7"), 7);
  EXPECT_EQ(scan("%*s %*d %lf", "abc 3 7"), 7);
  EXPECT_EQ(scan("Temperature", "Temperature"), std::nullopt) << "no conversion";
  EXPECT_EQ(scanLong("%d", "-12"), -12);
  EXPECT_EQ(scanLong("%x", "ffffffff"), -1);
  EXPECT_EQ(scanLong("%x", "-1"), -1);
  EXPECT_EQ(scanLong("%2d", "1234"), 12);
}

TEST(ValueFormat, ScansNoNumberThatDoesNotFit) {
  EXPECT_EQ(scanLong("%d", "2147483647"), 2147483647);
  EXPECT_EQ(scanLong("%d", "2147483648"), std::nullopt);
  EXPECT_EQ(scanLong("%ld", "99999999999"), std::nullopt);
  EXPECT_EQ(scanLong("%d", "99999999999999999999"), std::nullopt);
  EXPECT_EQ(scanLong("%d", "-99999999999999999999"), std::nullopt);
  EXPECT_EQ(scanLong("%x", "1FFFFFFFF"), std::nullopt);
  EXPECT_EQ(scanLong("%x", "1FFFFFFFFFFFFFFFFF"), std::nullopt);
  EXPECT_EQ(scanLong("%x", "-1FFFFFFFF"), std::nullopt);
  EXPECT_EQ(scan("%lf", "1e999"), std::nullopt);
  EXPECT_EQ(scan("%lf", "-1e999"), std::nullopt);
  EXPECT_EQ(scan("%lf", "1e-999"), 0);
  EXPECT_EQ(scan("%lf", "inf"), std::numeric_limits<double>::infinity());
}

TEST(ValueFormat, RefusesFormatsWithoutDefinedBehaviour) {
  for (const auto* format : {"%n", "%s", "%d %d", "%", "%5", "%*d", "%f", "%hd", "%Lf", "%p",
                             "%1000d", "%1$d", "%lc", "%lld", "%.9999d", "%m"})
    EXPECT_THROW(Long(format, FormatUse::print), std::invalid_argument) << format;
  for (const auto* format : {"%n", "%s", "%c", "%[a]", "%*[a", "%*[]", "%lf", "%d%d", "%0d", "%md",
                             "%", "%*", "%*n", "%*p", "%hhd"})
    EXPECT_THROW(Long(format, FormatUse::scan), std::invalid_argument) << format;
  for (const auto* format : {"%d", "%Lf", "%n", "%s", "%f%f"}) {
    EXPECT_THROW(Double(format, FormatUse::print), std::invalid_argument) << format;
    EXPECT_THROW(Double(format, FormatUse::scan), std::invalid_argument) << format;
  }
}

}  // namespace
}  // namespace mpf::test
