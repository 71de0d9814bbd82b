// SPDX-License-Identifier: MIT
#include "tools/text/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

TEST(Table, ColumnsAreAsWideAsTheirWidestCell) {
  Table table({"NAME", ">COUNT", "WORD"});
  table.add({"a", "1", "x"});
  table.add({"longer", "12345678", "y"});

  EXPECT_EQ(table.text(),
            "NAME       COUNT  WORD\n"
            "a              1  x\n"
            "longer  12345678  y\n");
}

TEST(Table, IndentsRowsAndHasNoTrailingBlanks) {
  Table table({"A", "B"});
  table.add({"1", ""});

  EXPECT_EQ(table.text("  "), "  A  B\n  1\n");
}

TEST(Table, IsEmptyUntilSomethingIsAdded) {
  Table table({"A"});
  EXPECT_TRUE(table.isEmpty());

  table.add({""});

  EXPECT_FALSE(table.isEmpty());
}

// Columns are aligned by the visible width of a name, not by its number of bytes.
TEST(Table, AlignsNamesByColumnsNotBytes) {
  Table table({"NAME", ">UNIT", "WORD"});
  table.add({"Ofen-Süd", "°C", "x"});
  table.add({"電圧", "V", "y"});

  EXPECT_EQ(table.text(),
            "NAME      UNIT  WORD\n"
            "Ofen-Süd    °C  x\n"
            "電圧         V  y\n");
}

TEST(Table, CountsInvalidUtf8AsOneColumnForEachByte) {
  Table table({"A", "B"});
  table.add({"\xff\xfe", "x"});
  table.add({"123", "y"});

  EXPECT_EQ(table.text(), "A    B\n\xff\xfe   x\n123  y\n");
}

// No column may be cut: a table that fits looks the same.
TEST(Table, FittedDoesNotChangeATableThatFits) {
  Table table({"NAME", ">COUNT", "~PROGRAM", "PEERS"});
  table.add({"dac", "1", "mpf-dac-server", "ioc1, ioc2"});

  EXPECT_EQ(table.fitted("  "), table.text("  "));
}

TEST(Table, FittedWrapsTheLastColumnBelowItself) {
  Table table({"CLIENT", ">PID", "SERVERS"});
  table.add({"mpf", "17",
             "serial-0, serial-1, serial-2, serial-3, serial-4, serial-5, serial-6, "
             "serial-7"});
  table.add({"ioc", "4711", "dac"});

  EXPECT_EQ(table.fitted("  "),
            "  CLIENT   PID  SERVERS\n"
            "  mpf       17  serial-0, serial-1, serial-2, serial-3, serial-4, serial-5,\n"
            "                serial-6, serial-7\n"
            "  ioc     4711  dac\n");
}

TEST(Table, FittedCutsCellsOfAMarkedColumnAndNoOthers) {
  Table table({"SERVER", "~PROGRAM", ">TAKEN"});
  table.add({"dac", std::string(100, 'p'), "1234567890"});

  EXPECT_EQ(table.fitted(), "SERVER  PROGRAM" + std::string(60, ' ') + "TAKEN\n" + "dac     " +
                                std::string(59, 'p') + "~  1234567890\n");
}

// A cut cell keeps eight columns, and at least those of its heading.
TEST(Table, FittedKeepsTheBeginningOfACutCell) {
  Table table({">COUNT", "~A", "~LONG HEADING", ">END"});
  table.add({std::string(70, '1'), std::string(20, 'a'), std::string(20, 'b'), "2"});

  const auto text = table.fitted();

  EXPECT_THAT(text, testing::HasSubstr("  aaaaaaa~  "));
  EXPECT_THAT(text, testing::HasSubstr("  bbbbbbbbbbb~  "));
}

TEST(Table, FittedGivesAFirstCellThatIsTooLongALineOfItsOwn) {
  Table table({"SERVER", "STATE", ">PID"});
  table.add({std::string(90, 's'), "alive", "17"});
  table.add({"dac", "dead", "4"});

  EXPECT_EQ(table.fitted("  "), "  SERVER" + std::string(62, ' ') + "STATE  PID\n  " +
                                    std::string(78, 's') + "\n    " + std::string(12, 's') + "\n" +
                                    std::string(70, ' ') + "alive   17\n" + "  dac" +
                                    std::string(65, ' ') + "dead     4\n");
}

TEST(Table, FittedNeverExceedsTheLineWithWrappedAndCutColumns) {
  Table table({"NAME", "~PROGRAM", "STATE", ">PID", "REMARKS"});
  table.add({std::string(40, 'n'), std::string(40, 'p'), "alive", "12345",
             "several words that do not fit into the rest of the line, not even in two lines"});

  const auto text = table.fitted("    ");

  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    EXPECT_LE(columnsOf(line), lineColumns()) << line;
}

}  // namespace
}  // namespace mpf::tools
