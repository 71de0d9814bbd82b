// SPDX-License-Identifier: MIT
#include "drivers/serial/mark_decoder.h"

#include <gtest/gtest.h>

namespace mpf {
namespace {

using Bytes = std::vector<LineByte>;
constexpr auto kDamage = LineFault::parity;

Bytes decoded(std::initializer_list<std::vector<std::uint8_t>> pieces) {
  MarkDecoder decoder;
  Bytes bytes;
  for (const auto& piece : pieces) decoder.decode(piece, kDamage, bytes);
  return bytes;
}

TEST(MarkDecoder, PassesPlainBytes) {
  EXPECT_EQ(decoded({{'a', 0, 0xfe}}), (Bytes{{'a'}, {0}, {0xfe}}));
}

TEST(MarkDecoder, RemovesOneOfTwoEqualMarks) {
  EXPECT_EQ(decoded({{0xff, 0xff, 'a'}}), (Bytes{{0xff}, {'a'}}));
}

TEST(MarkDecoder, MarksDamagedBytes) {
  EXPECT_EQ(decoded({{'a', 0xff, 0, 'b', 'c'}}), (Bytes{{'a'}, {'b', kDamage}, {'c'}}));
}

TEST(MarkDecoder, MarksADamagedByteThatEqualsAMark) {
  EXPECT_EQ(decoded({{0xff, 0, 0xff, 'a'}}), (Bytes{{0xff, kDamage}, {'a'}}));
}

TEST(MarkDecoder, ReportsBreaks) {
  EXPECT_EQ(decoded({{0xff, 0, 0, 'a'}}), (Bytes{{0, LineFault::breakSignal}, {'a'}}));
}

// A read may end at any byte.
TEST(MarkDecoder, AcceptsMarksThatAreSplitBetweenReads) {
  EXPECT_EQ(decoded({{'a', 0xff}, {0}, {'b', 0xff}, {0xff, 'c'}}),
            (Bytes{{'a'}, {'b', kDamage}, {0xff}, {'c'}}));
}

}  // namespace
}  // namespace mpf
