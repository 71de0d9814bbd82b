// SPDX-License-Identifier: MIT
#include "crate/startup/shell/diagnostics.h"

#include <gtest/gtest.h>
#include <string>

namespace mpf::test {
namespace {

using startup::Diagnostic;
using startup::Severity;

TEST(DiagnosticsTest, ShowPlaceLineAndCaret) {
  const Diagnostic diagnostic{Severity::error, {"st.cmd", 12, 5}, {}, "wrong", "abc def"};

  EXPECT_EQ(diagnostic.formatted(), "st.cmd:12:5: error: wrong\n  abc def\n      ^");
}

TEST(DiagnosticsTest, ShowFilesThatLedThere) {
  const Diagnostic diagnostic{Severity::note, {"b", 2, 0}, {{"a", 7, 1}}, "text", ""};

  EXPECT_EQ(diagnostic.formatted(), "in a file that a:7:1 includes:\nb:2: note: text");
}

TEST(DiagnosticsTest, MakeBytesOfTheFilePrintable) {
  const Diagnostic diagnostic{Severity::error, {"x", 1, 2}, {}, "bad \x1b", "\x1b[2J\tz"};

  EXPECT_EQ(diagnostic.formatted(), "x:1:2: error: bad \\x1b\n  \\x1b[2J\\tz\n      ^");
}

TEST(DiagnosticsTest, ShowThePartOfALongLineAroundTheColumn) {
  const auto line = std::string(5000, 'a') + "!" + std::string(5000, 'b');
  const Diagnostic diagnostic{Severity::error, {"x", 1, 5001}, {}, "t", line};

  EXPECT_LT(diagnostic.formatted().size(), 300U);
  EXPECT_NE(diagnostic.formatted().find("aa!bb"), std::string::npos);
}

TEST(DiagnosticsTest, AreCountedBeyondTheirLimit) {
  startup::Diagnostics diagnostics;
  for (std::size_t i = 0; i < diagnostics.kMaxKept + 5; ++i)
    diagnostics.add({Severity::warning, {"x", i, 1}, {}, "t", ""});

  EXPECT_EQ(diagnostics.all().size(), diagnostics.kMaxKept);
  EXPECT_EQ(diagnostics.count(Severity::warning), diagnostics.kMaxKept + 5);
  EXPECT_FALSE(diagnostics.hasErrors());
}

}  // namespace
}  // namespace mpf::test
