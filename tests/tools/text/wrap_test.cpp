// SPDX-License-Identifier: MIT
// Texts in 80 columns.
#include "tools/text/wrap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

namespace mpf::tools {
namespace {

std::vector<std::string> wrapped(const std::string& first, const std::string& text,
                                 std::size_t indent) {
  std::vector<std::string> lines;
  std::istringstream all(wrap(first, text, indent));
  for (std::string line; std::getline(all, line);) lines.push_back(line);
  return lines;
}

TEST(Wrap, KeepsATextThatFitsInOneLine) {
  EXPECT_EQ(wrap("  a ", "b c", 4), "  a b c\n");
  EXPECT_EQ(wrap("", std::string(80, 'x'), 4), std::string(80, 'x') + "\n");
}

TEST(Wrap, BreaksBetweenWords) {
  const auto lines = wrapped("- ", std::string(40, 'a') + " " + std::string(37, 'b') + " c", 2);

  EXPECT_THAT(
      lines, testing::ElementsAre("- " + std::string(40, 'a') + " " + std::string(37, 'b'), "  c"));
}

TEST(Wrap, BreaksAWordThatIsLongerThanALine) {
  const auto lines = wrapped("- ", "a " + std::string(100, 'x') + " b", 4);

  EXPECT_THAT(lines, testing::ElementsAre("- a", "    " + std::string(76, 'x'),
                                          "    " + std::string(24, 'x') + " b"));
}

TEST(Wrap, KeepsSeveralBlanksInAName) { EXPECT_EQ(wrap("", "a  b   c", 4), "a  b   c\n"); }

TEST(Wrap, NeverBreaksInsideACharacter) {
  std::string text;
  for (int i = 0; i < 100; ++i) text += "°";

  for (const auto& line : wrapped("x", text, 3)) {
    EXPECT_LE(columnsOf(line), kColumns);
    EXPECT_EQ(std::ranges::count(line, '\xc2'), std::ranges::count(line, '\xb0'));
  }
}

TEST(Cut, KeepsATextThatFits) { EXPECT_EQ(cut("Ofen °C", 7), "Ofen °C"); }

TEST(Cut, MarksATextThatDoesNotFit) {
  EXPECT_EQ(cut("voltmeter", 5), "volt~");
  EXPECT_EQ(cut("°°°°", 3), "°°~");
}

}  // namespace
}  // namespace mpf::tools
