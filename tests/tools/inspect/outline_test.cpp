// SPDX-License-Identifier: MIT
#include "tools/inspect/outline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

namespace mpf::tools {
namespace {

using testing::HasSubstr;
using testing::Not;

// `count` bytes of this value, as hexadecimal digits.
std::string repeated(const std::string& digits, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += digits;
  return text;
}

TEST(HexDump, ALineHasOffsetBytesAndCharacters) {
  EXPECT_EQ(hexDump("4d50462d57494e310001207e7f80ff41", 0),
            "0000  4d 50 46 2d 57 49 4e 31 00 01 20 7e 7f 80 ff 41  MPF-WIN1.. ~...A\n");
}

TEST(HexDump, AShortLastLineKeepsTheColumnOfCharacters) {
  EXPECT_EQ(hexDump(repeated("41", 16) + "4243", 2),
            "  0000  41 41 41 41 41 41 41 41 41 41 41 41 41 41 41 41  AAAAAAAAAAAAAAAA\n"
            "  0010  42 43" +
                std::string(42, ' ') + "  BC\n");
}

TEST(HexDump, NoBytesAreNoLines) { EXPECT_EQ(hexDump("", 4), ""); }

// The offset of the line after the "*" shows how many lines were left out.
TEST(HexDump, ARunOfEqualLinesIsOneStar) {
  const auto dump = hexDump(repeated("00", 64) + repeated("ff", 16), 0);

  std::istringstream lines(dump);
  std::vector<std::string> begins;
  for (std::string line; std::getline(lines, line);) begins.push_back(line.substr(0, 4));
  EXPECT_THAT(begins, testing::ElementsAre("0000", "*", "0040"));
}

// The end of the bytes is always visible.
TEST(HexDump, ShowsTheLastLineEvenIfItIsEqual) {
  const auto dump = hexDump(repeated("00", 64), 0);

  EXPECT_THAT(dump, HasSubstr("*\n0030 "));
}

TEST(HexDump, EachRunHasAStarOfItsOwn) {
  const auto dump =
      hexDump(repeated("00", 32) + repeated("01", 32) + repeated("02", 16) + repeated("03", 32), 1);

  EXPECT_THAT(dump, Not(HasSubstr("*\n *")));
  std::istringstream lines(dump);
  std::vector<std::string> begins;
  for (std::string line; std::getline(lines, line);) begins.push_back(line.substr(0, 5));
  EXPECT_THAT(begins,
              testing::ElementsAre(" 0000", " *", " 0020", " *", " 0040", " 0050", " 0060"));
}

TEST(Outline, ValuesAreLinesWithReadableNames) {
  const Tree tree{{"queue_size", 7}, {"rescan", true}, {"tls", false}, {"name", "dac 1"}};

  EXPECT_EQ(outline(tree, 2), "  queue size: 7\n  rescan: yes\n  tls: no\n  name: dac 1\n");
}

TEST(Outline, AnObjectOfPlainValuesIsOneLine) {
  const Tree tree{{"owner", {{"pid", 17}, {"start_ticks", 4}, {"program", "mpf"}}}};

  EXPECT_EQ(outline(tree), "owner: pid 17, start ticks 4, program mpf\n");
}

TEST(Outline, LeavesOutEmptyTextsInAnObject) {
  EXPECT_EQ(outline({{"owner", {{"pid", 17}, {"program", ""}}}}), "owner: pid 17\n");
}

TEST(Outline, AnArrayOfPlainValuesIsOneLine) {
  EXPECT_EQ(outline({{"ready", {3, 300}}, {"knocks", Tree::array()}}),
            "ready: 3 300\nknocks: none\n");
}

TEST(Outline, OtherObjectsAreIndented) {
  const Tree tree{{"requests", {{"slots", 16}, {"limits", {{"a", 1}}}}}, {"end", 2}};

  EXPECT_EQ(outline(tree), "requests:\n  slots: 16\n  limits: a 1\nend: 2\n");
}

TEST(Outline, EachEntryOfAListIsALine) {
  const Tree tree{{"segments", {{{"file", "x"}, {"chunk_count", 2}}, {{"file", "y"}}}}};

  EXPECT_EQ(outline(tree), "segments: file x, chunk count 2\nsegments: file y\n");
}

TEST(Outline, LongLinesAreWrappedAndIndented) {
  std::string words;
  for (int i = 0; i < 30; ++i) words += "word ";

  const auto text = outline({{"problem", words}}, 4);

  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  EXPECT_TRUE(line.starts_with("    problem: word")) << line;
  while (std::getline(lines, line)) {
    EXPECT_LE(line.size(), 80U);
    EXPECT_TRUE(line.starts_with("      word")) << line;
  }
}

Tree messageTree(const char* state) {
  return {{"position", 1748}, {"state", state}, {"request_id", 17}};
}

TEST(Outline, AMessageIsItsPositionStateAndText) {
  auto message = messageTree("waiting");
  message["text"] = "int32 value=5";

  EXPECT_EQ(outline({{"messages", {message}}}, 2),
            "  messages:\n"
            "      1748 waiting     #17 int32 value=5\n");
}

TEST(Outline, AMessageThatCannotBeReadSaysWhy) {
  auto message = messageTree("taken");
  message["chunk"] = {{"side", 0}, {"segment", 1}};
  message["problem"] = "gone";

  EXPECT_EQ(outline({{"messages", {message}}}),
            "messages:\n"
            "    1748 taken       #17 (in a chunk: side 0, segment 1) unreadable: gone\n");
}

TEST(Outline, TheBytesOfAMessageAreAHexDumpBelowIt) {
  auto message = messageTree("freed");
  message["text"] = "int32";
  message["raw"] = "4142";

  EXPECT_EQ(outline({{"messages", {message}}}),
            "messages:\n"
            "    1748 freed       #17 int32\n"
            "0000  41 42" +
                std::string(42, ' ') + "  AB\n");
}

TEST(Outline, TheBytesOfASegmentAreAHexDump) {
  EXPECT_EQ(outline({{"raw", "41"}}), "raw:\n  0000  41" + std::string(45, ' ') + "  A\n");
}

}  // namespace
}  // namespace mpf::tools
