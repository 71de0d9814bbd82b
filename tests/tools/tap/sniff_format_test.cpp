// SPDX-License-Identifier: MIT
// SniffFormat: the output formats of `mpf sniff`.
#include "tools/tap/sniff_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace mpf::tools {
namespace {

using namespace std::chrono_literals;
using serial::SniffKind;
using serial::SniffRecord;

constexpr std::int64_t kMs = 1'000'000;

class SniffFormatTest : public testing::Test {
 protected:
  void SetUp() override {
    ::setenv("TZ", "UTC", 1);
    ::tzset();
  }
  // Adds each byte of `bytes`, at `atNs`.
  static std::string add(SniffFormat& format, SniffKind kind, std::string_view bytes,
                         std::int64_t atNs = 0) {
    std::string text;
    for (const char byte : bytes) text += format.add({atNs, kind, static_cast<std::uint8_t>(byte)});
    return text;
  }
};

TEST_F(SniffFormatTest, RefusesAnUnknownFormat) {
  try {
    static_cast<void>(SniffFormat::make("hex", 0));
    FAIL() << "make() did not throw";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "unknown sniff format \"hex\"; use lines, manual or json");
  }
}

// The bytes of the example in the manual, "serialPortSniff", give its lines.
TEST_F(SniffFormatTest, ManualPrintsTheExampleOfTheManual) {
  constexpr std::string_view kManual =
      "T31 T34 R31 T35 R34 T00 R35 R00 T31 T34 14154.5.14\n"
      "R31 T36 R34 T00 R36 R00 T34 T31 R34 T32 164.6.4142\n"
      "R31 T00 R32 R00 T31 T34 R31 T37 R34 T00 1.2.14174.\n"
      "R37 R00 T31 T34 R31 T38 R34 T00 R38 R00 7.14184.8.\n"
      "T31 T34 R31 T39 R34 T00 R39 R00 T31 T35 14194.9.15\n"
      "R31 T30 R35 T00 R30 R00 T31 T35 R31 T31 105.0.1511\n"
      "R35 T00 R31 R00 T34 T31 R34 T33 R31 T00 5.1.41431.\n"
      "R33 R00 T31 T35 R31 T32 R35 T00 R32 R00 3.15125.2.\n"
      "T31 T35 R31 T33 R35 T00 R33 R00 T31 T35 15135.3.15\n"
      "R31 T34 R35 T00 R34 R00 145.4.\n";
  const auto format = SniffFormat::make("manual", 0);

  std::string text;
  for (std::size_t at = 0; at + 4 <= kManual.size(); ++at) {
    const auto word = kManual.substr(at, 4);
    if ((word[0] != 'T' && word[0] != 'R') || word[3] != ' ') continue;
    text += format->add(
        {0, static_cast<SniffKind>(word[0]),
         static_cast<std::uint8_t>(std::stoi(std::string(word.substr(1, 2)), nullptr, 16))});
  }
  text += format->flush();

  EXPECT_EQ(text, kManual);
}

TEST_F(SniffFormatTest, ManualPrintsALineOfTenBytesAndTheRestOnFlush) {
  const auto format = SniffFormat::make("manual", 0);

  EXPECT_EQ(add(*format, SniffKind::sent, "123456789"), "");
  EXPECT_EQ(add(*format, SniffKind::sent, "0"),
            "T31 T32 T33 T34 T35 T36 T37 T38 T39 T30 1234567890\n");
  EXPECT_EQ(format->flush(), "");
  EXPECT_EQ(add(*format, SniffKind::received, "~"), "");
  EXPECT_EQ(format->flush(), "R7E ~\n");
  EXPECT_EQ(format->flush(), "");
}

TEST_F(SniffFormatTest, ManualPrintsOtherBytesThanAsciiAsDots) {
  const auto format = SniffFormat::make("manual", 0);

  add(*format, SniffKind::received, "\x1f \x7e\x7f\xff");
  add(*format, SniffKind::damaged, "a");
  add(*format, SniffKind::breakSignal, std::string_view("\0", 1));

  EXPECT_EQ(format->flush(), "R1F R20 R7E R7F RFF r61 B00 . ~..a.\n");
}

TEST_F(SniffFormatTest, ManualMarksMissingBytes) {
  const auto format = SniffFormat::make("manual", 0);
  add(*format, SniffKind::sent, "ab");

  EXPECT_EQ(format->missing(7), "T61 T62 ab\n(7 bytes missing)\n");
}

// The wall clock shows 10:20:30.400 UTC when the monotonic clock is 0.
constexpr std::int64_t kWallNs = ((10 * 60 + 20) * 60 + 30) * 1000 * kMs + 400 * kMs;

TEST_F(SniffFormatTest, LinesEndAtANewlineATurnAndAPause) {
  const auto format = SniffFormat::make("lines", kWallNs);

  EXPECT_EQ(add(*format, SniffKind::sent, "*IDN?"), "");
  EXPECT_EQ(add(*format, SniffKind::sent, "\n"), "10:20:30.400       +0.0 ms  T  *IDN?\\n\n");
  EXPECT_EQ(add(*format, SniffKind::received, "MPF", 12'300'000), "");
  EXPECT_EQ(add(*format, SniffKind::sent, "x", 13 * kMs), "10:20:30.412      +12.3 ms  R  MPF\n");
  EXPECT_EQ(format->flush(), "10:20:30.413       +0.7 ms  T  x\n");
  EXPECT_EQ(format->flush(), "");
}

TEST_F(SniffFormatTest, LinesShowControlCharactersDamageAndBreaks) {
  const auto format = SniffFormat::make("lines", kWallNs);

  auto text = add(*format, SniffKind::received, "\x1b[2J");
  text += add(*format, SniffKind::damaged, "\xff");
  text += add(*format, SniffKind::breakSignal, std::string_view("\0", 1));
  text += format->flush();

  EXPECT_THAT(text, testing::HasSubstr("R  \\x1b[2J\n"));
  EXPECT_THAT(text, testing::HasSubstr("r  \\xff\n"));
  EXPECT_THAT(text, testing::HasSubstr("B  \\x00\n"));
}

TEST_F(SniffFormatTest, LinesWithoutNewlineAreSplit) {
  const auto format = SniffFormat::make("lines", 0);

  auto text = add(*format, SniffKind::received, std::string(200, 'x'));
  text += format->flush();

  EXPECT_EQ(std::ranges::count(text, '\n'), 3);
  EXPECT_EQ(std::ranges::count(text, 'x'), 200);
}

TEST_F(SniffFormatTest, LinesMarkMissingBytes) {
  const auto format = SniffFormat::make("lines", kWallNs);
  add(*format, SniffKind::received, "1.2");

  EXPECT_EQ(format->missing(3), "10:20:30.400       +0.0 ms  R  1.2\n(3 bytes missing)\n");
}

TEST_F(SniffFormatTest, JsonIsAnObjectForEachByte) {
  const auto format = SniffFormat::make("json", kWallNs);

  EXPECT_EQ(format->add({5, SniffKind::sent, 0x22}),
            "{\"at_ns\": 5, \"kind\": \"T\", \"value\": 34}\n");
  EXPECT_EQ(format->missing(3), "{\"missing\": 3}\n");
  EXPECT_EQ(format->flush(), "");
  for (const auto kind :
       {SniffKind::sent, SniffKind::received, SniffKind::damaged, SniffKind::breakSignal}) {
    const auto object = nlohmann::json::parse(format->add({1, kind, 255}));
    EXPECT_EQ(object.at("kind"), std::string(1, static_cast<char>(kind)));
  }
}

}  // namespace
}  // namespace mpf::tools
