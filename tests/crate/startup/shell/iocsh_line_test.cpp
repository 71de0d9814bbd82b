// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <string>

#include "tests/crate/startup/shell/shell_scene.h"

namespace mpf::test {
namespace {

// The last command of an iocsh file.
struct Ran {
  Texts calls;
  Texts reports;
};

Ran run(const std::string& line) {
  ShellScene scene;
  scene.shell.forceDialect(startup::Dialect::iocsh);
  scene.shell.setEnvironment("TOP", "/top");
  scene.run(line + "\n");
  return {scene.calls, scene.reports()};
}

TEST(IocshLineTest, SplitsWordsAtBlanksCommasAndParentheses) {
  for (const auto* line :
       {"f(1,\"a b\")", "f 1 \"a b\"", "f 1,\"a b\"", "f  (1 , 'a b')\r", "\tf 1 a\\ b"})
    EXPECT_EQ(run(line).calls, Texts{"f(1, \"a b\")"}) << line;
  EXPECT_EQ(run("f IP_a $(TOP)/x &prog 0x10 ''").calls,
            Texts{"f(\"IP_a\", \"/top/x\", &prog, 0x10, \"\")"});
}

TEST(IocshLineTest, CommentsAreWholeLines) {
  EXPECT_EQ(run("  # f $(NOTHING)").calls, Texts{});
  EXPECT_EQ(run("f \"#C0\" #1").calls, Texts{"f(\"#C0\", \"#1\")"});
}

TEST(IocshLineTest, PassesEscapesInQuotesAsTheyAre) {
  EXPECT_EQ(run("f \"\\r\"").calls, Texts{"f(\"\\r\")"});
}

TEST(IocshLineTest, RedirectsInputOnly) {
  EXPECT_EQ(run("ld < a/b").calls, Texts{"ld(\"a/b\")"});
  EXPECT_EQ(run("f 1 >> /tmp/x").calls, Texts{"f(1)"});
  EXPECT_EQ(run("f 1 2>/tmp/x").reports.size(), 1U);
}

TEST(IocshLineTest, ReportsErrors) {
  EXPECT_EQ(run("f \"a").reports, Texts{"1:3 error a quotation mark is not closed in this line"});
  EXPECT_EQ(run("<").reports, Texts{"1:1 error the name of a file is expected"});
  EXPECT_EQ(run("f $(NOTHING)").reports,
            Texts{"1:0 warning the macro NOTHING has no value: set it with epicsEnvSet"});
}

}  // namespace
}  // namespace mpf::test
