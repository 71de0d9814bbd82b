// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_commands.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <string>

#include "tests/drivers/gpib/gpib_test_values.h"

namespace mpf::test {
namespace {

std::string linesFor(std::string_view data, bool end) {
  std::string lines;
  prologix::appendData(lines, raw(data), end);
  return lines;
}

TEST(PrologixCommands, SecondaryAddressesBeginAt96) {
  EXPECT_EQ(prologix::addressText({.primary = 22}), "22");
  EXPECT_EQ(prologix::addressText({.primary = 9, .secondary = 5}), "9 101");
}

TEST(PrologixCommands, EscapesWhatTheControllerWouldInterpret) {
  EXPECT_EQ(linesFor("a+\r\n\x1b"
                     "b",
                     true),
            "++eoi 1\na\x1b+\x1b\r\x1b\n\x1b\x1b"
            "b\n");
}

TEST(PrologixCommands, SendsEndWithTheLastPieceOnly) {
  const auto lines = linesFor(std::string(300, 'x'), true);

  EXPECT_EQ(lines.find("++eoi 0\n"), 0U);
  const auto last = lines.find("++eoi 1\n");
  ASSERT_NE(last, std::string::npos);
  EXPECT_EQ(std::count(lines.begin() + static_cast<std::ptrdiff_t>(last), lines.end(), '\n'), 2);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), 'x'), 300);
}

TEST(PrologixCommands, NoLineExceedsTheBufferOfAController) {
  const auto lines = linesFor(std::string(1000, '\n'), true);

  std::size_t length = 0;
  bool isEscaped = false;
  for (const char byte : lines) {
    length = byte == '\n' && !isEscaped ? 0 : length + 1;
    isEscaped = !isEscaped && byte == prologix::kEscape;
    EXPECT_LT(length, 127U);
  }
}

TEST(PrologixCommands, WithoutEndNoPieceHasEnd) {
  EXPECT_EQ(linesFor("abc", false), "++eoi 0\nabc\n");
  EXPECT_EQ(linesFor(std::string(300, 'x'), false).find("++eoi 1"), std::string::npos);
}

}  // namespace
}  // namespace mpf::test
