// SPDX-License-Identifier: MIT
#include "crate/startup/shell/lexer.h"

#include <gtest/gtest.h>
#include <string>

namespace mpf::test {
namespace {

using startup::LineError;
using startup::Token;

Token first(std::string_view line) { return startup::Lexer(line).token(); }

void drain(std::string_view line) {
  startup::Lexer lexer(line);
  while (lexer.token().kind != Token::Kind::end) lexer.advance();
}

TEST(LexerTest, ReadsIntegersOfC) {
  EXPECT_EQ(first("9600").integer, 9600);
  EXPECT_EQ(first("0xB0000000").integer, 0xB0000000);
  EXPECT_EQ(first("017").integer, 15);
  EXPECT_EQ(first("10UL").integer, 10);
  EXPECT_EQ(first("'N'").integer, 'N');
  EXPECT_EQ(first("'\\r'").integer, '\r');
  EXPECT_EQ(first("'\\''").integer, '\'');
}

TEST(LexerTest, ReadsRealNumbers) {
  EXPECT_EQ(first(".5").real, .5);
  EXPECT_EQ(first("5.0").real, 5.0);
  EXPECT_EQ(first("1e-3").real, 1e-3);
  EXPECT_EQ(first("2.5E+2f").real, 250.);
}

TEST(LexerTest, ReplacesEscapesOfStrings) {
  EXPECT_EQ(first(R"("\r\n\t\\\"\015\x0d\101z\q")").text, "\r\n\t\\\"\r\rAzq");
  EXPECT_EQ(first(R"("ab\0cd")").text, "ab");
  EXPECT_EQ(startup::unescaped(R"(\r\012\)"), "\r\n\\");
}

TEST(LexerTest, CommentsEndNoString) {
  EXPECT_EQ(first(R"("#.#.#.# // /* */")").text, "#.#.#.# // /* */");
  for (const auto* line : {"  # text", "/* a */ /* b */", "// x", "/* # */", ""})
    EXPECT_EQ(first(line).kind, Token::Kind::end) << line;
}

TEST(LexerTest, ReadsTheLongestOperator) {
  EXPECT_EQ(first("<<=1").text, "<<=");
  EXPECT_EQ(first("<= 1").text, "<=");
}

TEST(LexerTest, ReadsFileNamesAsTheyAre) {
  for (const auto* line : {"< ../a/b.68K", "<../a/b.68K  # comment", "< \"../a/b.68K\";"}) {
    startup::Lexer lexer(line);
    ASSERT_TRUE(lexer.token().isSymbol("<"));
    EXPECT_EQ(lexer.readFileName(), "../a/b.68K") << line;
  }
}

TEST(LexerTest, RefusesWhatIsNoToken) {
  for (const auto* line : {"\"abc", "'ab'", "'", "12abc", "08", "0x", "1.2.3", "/* abc", "@",
                           "\"a\\", "99999999999999999999", "\xff", "'\\"})
    EXPECT_THROW(drain(line), LineError) << line;
}

}  // namespace
}  // namespace mpf::test
