// SPDX-License-Identifier: MIT
// Text of other processes and hosts, made safe to show.
#include "base/printable.h"

#include <gtest/gtest.h>

namespace mpf {
namespace {

TEST(Printable, LeavesPrintableTextUnchanged) {
  for (const std::string text : {"", "dac", "Ofen-Süd °C", "電圧", "\U0001F525", "a\\b \"c\" ~"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, EscapesControlCharacters) {
  EXPECT_EQ(printable("a\x1b[2Jb"), "a\\x1b[2Jb");
  EXPECT_EQ(printable("a\r\n\tb\x7f"), "a\\r\\n\\tb\\x7f");
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("a\u009bb"), "a\\u009bb");  // some terminals interpret it as ESC [
}

TEST(Printable, EscapesBidirectionalAndInvisibleCharacters) {
  EXPECT_EQ(printable("a\u202eb"), "a\\u202eb");
  EXPECT_EQ(printable("\u2066\u2069\u061c\u200f"), "\\u2066\\u2069\\u061c\\u200f");
  EXPECT_EQ(printable("a\u200b\ufeff\u00ad\u2028"), "a\\u200b\\ufeff\\u00ad\\u2028");
  EXPECT_EQ(printable("\U000e0041"), "\\U000e0041");
}

TEST(Printable, EscapesEachByteThatIsNotUtf8) {
  EXPECT_EQ(printable("S\xfc"
                      "d"),
            "S\\xfcd");                     // Latin-1
  EXPECT_EQ(printable("\xc2"), "\\xc2");                            // cut
  EXPECT_EQ(printable("\xe2\x80"), "\\xe2\\x80");                   // cut
  EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b");                   // overlong ESC [
  EXPECT_EQ(printable("\xe0\x82\x9b"), "\\xe0\\x82\\x9b");          // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");          // a surrogate
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // beyond Unicode
  EXPECT_EQ(printable("\x80\xff"), "\\x80\\xff");
}

TEST(Printable, KeepsLineEndsInPrintableLines) {
  EXPECT_EQ(printableLines("a\r\nb\n"), "a\\r\nb\n");
}

TEST(Printable, KeepsTheMeaningOfAJsonDocument) {
  EXPECT_EQ(printableJson("{\n \"a\": \"b\u202e\x7f\u00fc\"\n}"),
            "{\n \"a\": \"b\\u202e\\u007f\u00fc\"\n}");
  EXPECT_EQ(printableJson("\"\U000e0041\""), "\"\\udb40\\udc41\"");
}

}  // namespace
}  // namespace mpf
