// SPDX-License-Identifier: MIT
// GpibSniffFormat: the output formats of `mpf gpib-sniff`.
#include "tools/tap/gpib_sniff_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace mpf::tools {
namespace {

using GpibRecord = gpib::SniffRecord;

constexpr std::uint8_t kSent = 0;
constexpr std::uint8_t kCommand = GpibRecord::kAttention;
constexpr std::uint8_t kReceived = GpibRecord::kReceived;

class GpibSniffFormatTest : public testing::Test {
 protected:
  void SetUp() override {
    ::setenv("TZ", "UTC", 1);
    ::tzset();
  }
  // Adds each byte of `bytes`; the last one has EOI when `withEnd`.
  static std::string add(GpibSniffFormat& format, std::uint8_t flags, std::string_view bytes,
                         std::int64_t atNs = 0, bool withEnd = false) {
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const bool isEnd = withEnd && i + 1 == bytes.size();
      const auto all = static_cast<std::uint8_t>(flags | (isEnd ? GpibRecord::kEnd : 0));
      text += format.add({atNs, all, static_cast<std::uint8_t>(bytes[i])});
    }
    return text;
  }
};

TEST_F(GpibSniffFormatTest, RefusesAnUnknownFormat) {
  EXPECT_THROW(static_cast<void>(GpibSniffFormat::make("hex", 0)), std::invalid_argument);
}

// The bytes of the example in the manual, "gpibSniff", give its lines.
TEST_F(GpibSniffFormatTest, ManualPrintsTheExampleOfTheManual) {
  const auto format = GpibSniffFormat::make("manual", 0);

  auto text = add(*format, kCommand, "_?V");
  text += add(*format, kReceived, "-8.874270409E-01\r\n", 0, true);
  text += add(*format, kCommand, "_?_?V");
  text += add(*format, kReceived, "-9.341735006E-01\r\n", 0, true);
  text += add(*format, kCommand, "_?");
  text += format->flush() + format->end();

  EXPECT_EQ(text,
            "R\n"
            "T_?V\n"
            "R-8.874270409E-01 0x0d 0x0a\n"
            "T_?_?V\n"
            "R-9.341735006E-01 0x0d 0x0a\n"
            "T_?\n"
            "gpibSniff done\n");
}

TEST_F(GpibSniffFormatTest, ManualBeginsWithALineOfReceivedBytes) {
  EXPECT_EQ(GpibSniffFormat::make("manual", 0)->end(), "R\ngpibSniff done\n");
  const auto format = GpibSniffFormat::make("manual", 0);
  EXPECT_EQ(add(*format, kReceived, "1"), "R1");
  EXPECT_EQ(format->missing(1), "\n(1 byte missing)\n");
  EXPECT_EQ(add(*format, kSent, "\x7f"), "T 0x7f");
  EXPECT_EQ(format->end(), "\ngpibSniff done\n");
}

TEST_F(GpibSniffFormatTest, DecodeNamesCommandsAndQuotesData) {
  constexpr std::int64_t kMillisecond = 1'000'000;
  const auto format = GpibSniffFormat::make("decode", 0);

  auto text = add(*format, kCommand, "_?V", kMillisecond);
  text += add(*format, kReceived, "-8.8\r\n", 3 * kMillisecond, true);
  text += add(*format, kCommand, "6e", 4 * kMillisecond);
  text += add(*format, kSent, "ID", 5 * kMillisecond);
  text += format->flush();

  EXPECT_EQ(text,
            "00:00:00.001       +0.0 ms  T  UNT, UNL, TAG 22\n"
            "00:00:00.003       +2.0 ms  R  \"-8.8\\r\\n\", EOI\n"
            "00:00:00.004       +1.0 ms  T  LAG 22, SAD 5\n"
            "00:00:00.005       +1.0 ms  T  \"ID\"\n");
  EXPECT_EQ(format->flush(), "");
  EXPECT_EQ(format->end(), "");
}

TEST_F(GpibSniffFormatTest, DecodeEndsALineAtEndAndAfterEightyBytes) {
  const auto format = GpibSniffFormat::make("decode", 0);

  const auto text = add(*format, kReceived, std::string(100, 'x'), 0, true) +
                    add(*format, kReceived, "y", 0, true) + format->missing(3);

  EXPECT_EQ(text, "00:00:00.000       +0.0 ms  R  \"" + std::string(80, 'x') +
                      "\"\n"
                      "00:00:00.000       +0.0 ms  R  \"" +
                      std::string(20, 'x') +
                      "\", EOI\n"
                      "00:00:00.000       +0.0 ms  R  \"y\", EOI\n"
                      "(3 bytes missing)\n");
}

TEST_F(GpibSniffFormatTest, JsonHasAnObjectForEachByte) {
  const auto format = GpibSniffFormat::make("json", 0);

  const auto object = nlohmann::json::parse(add(*format, kCommand, "V", 7));

  EXPECT_EQ(object, nlohmann::json::parse(
                        R"({"at_ns":7,"direction":"T","atn":true,"eoi":false,"value":86})"));
  EXPECT_EQ(format->missing(2), "{\"missing\": 2}\n");
}

TEST(GpibCommandName, NamesEachCommand) {
  EXPECT_EQ(gpibCommandName(0x01), "GTL");
  EXPECT_EQ(gpibCommandName(0x08), "GET");
  EXPECT_EQ(gpibCommandName(0x14), "DCL");
  EXPECT_EQ(gpibCommandName(0x18), "SPE");
  EXPECT_EQ(gpibCommandName(0x20), "LAG 0");
  EXPECT_EQ(gpibCommandName(0x3e), "LAG 30");
  EXPECT_EQ(gpibCommandName('?'), "UNL");
  EXPECT_EQ(gpibCommandName('V'), "TAG 22");
  EXPECT_EQ(gpibCommandName('_'), "UNT");
  EXPECT_EQ(gpibCommandName(0x65), "SAD 5");
  EXPECT_EQ(gpibCommandName(0xbf), "UNL");
  EXPECT_EQ(gpibCommandName(0x02), "0x02");
}

}  // namespace
}  // namespace mpf::tools
