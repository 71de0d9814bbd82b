// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <string>

#include "tests/crate/startup/shell/shell_scene.h"

namespace mpf::test {
namespace {

// The calls of one line; symbol `five` is 5, `text` is "abc".
Texts callsOf(const std::string& line) {
  ShellScene scene;
  scene.shell.forceDialect(startup::Dialect::vxWorks);
  scene.shell.define("five", startup::Value::ofInteger(5));
  scene.shell.define("text", startup::Value::ofString("abc"));
  scene.run(line + "\n");
  EXPECT_EQ(scene.reports(), Texts{}) << line;
  return scene.calls;
}

Texts reportsOf(const std::string& line) {
  ShellScene scene;
  scene.shell.forceDialect(startup::Dialect::vxWorks);
  scene.shell.define("five", startup::Value::ofInteger(5));
  scene.run(line + "\n");
  return scene.reports();
}

TEST(VxWorksLineTest, CallsInAllStyles) {
  for (const auto* line : {"f(1,\"a\")", "f (1, \"a\")", "f 1,\"a\"", "f 1 , \"a\" ;",
                           " f(1,\"a\"\t)", "f(1,\"a\") /* c */", "f(1,\"a\") # c", "f 1,\"a\"\r"})
    EXPECT_EQ(callsOf(line), Texts{"f(1, \"a\")"}) << line;
  for (const auto* line : {"f", "f()", "f ( )", "f;", ";;f;;", "\tf"})
    EXPECT_EQ(callsOf(line), Texts{"f()"}) << line;
  EXPECT_EQ(callsOf("f(1); g 2; h"), (Texts{"f(1)", "g(2)", "h()"}));
}

TEST(VxWorksLineTest, PassesSymbolsAddressesAndCharacters) {
  EXPECT_EQ(callsOf("seq &prog, \"P=x\""), Texts{"seq(&prog, \"P=x\")"});
  EXPECT_EQ(callsOf("f(five, text, &five, 'N', .5)"), Texts{"f(5, \"abc\", &five, 78, 0.5)"});
  EXPECT_EQ(callsOf("f(nothing)"), Texts{"f(undefined symbol nothing)"});
  EXPECT_EQ(callsOf("f -1"), Texts{"f(-1)"});
  EXPECT_EQ(callsOf("f(*&five, *text)"), Texts{"f(5, 97)"});
}

TEST(VxWorksLineTest, EvaluatesExpressionsWithThePrecedenceOfC) {
  EXPECT_EQ(callsOf("f(1+2*3, (1+2)*3, 10-4-3, 1<<2+1, 1|2&3, -2*-3)"),
            Texts{"f(7, 9, 3, 8, 3, 6)"});
  EXPECT_EQ(callsOf("f(five == 5 && !0, 7 / 2, 7. / 2, (int)7.9, (double)1, (char *)text)"),
            Texts{"f(1, 3, 3.5, 7, 1, \"abc\")"});
  EXPECT_EQ(callsOf("five - 1"), Texts{});  // a value, which vxWorks would print
}

TEST(VxWorksLineTest, AssignsToKnownAndUnknownSymbols) {
  EXPECT_EQ(callsOf("x = 1024*1024*96; f(x)"), Texts{"f(100663296)"});
  EXPECT_EQ(callsOf("x=y=3;x += five;f x,y"), Texts{"f(8, 3)"});
}

TEST(VxWorksLineTest, AssignsResultsOfCalls) {
  EXPECT_EQ(callsOf("x = seven(1); f(x+1)"), (Texts{"seven(1)", "f(8)"}));
  EXPECT_EQ(callsOf("x = seven 1, 2; f(x)"), (Texts{"seven(1, 2)", "f(7)"}));
  EXPECT_EQ(callsOf("x = f(seven(1), g(2))"),
            (Texts{"seven(1)", "g(2)", "f(7, the result of a command)"}));
}

TEST(VxWorksLineTest, PassesTheFileOfARedirection) {
  EXPECT_EQ(callsOf("ld < ../mv162/mpfLib "), Texts{"ld(\"../mv162/mpfLib\")"});
  EXPECT_EQ(callsOf("ld <GpibHideosLocal.o"), Texts{"ld(\"GpibHideosLocal.o\")"});
}

TEST(VxWorksLineTest, OutputIsNotRedirected) {
  EXPECT_EQ(reportsOf("dbl > /tmp/list.txt"),
            Texts{"1:5 note the output is not written to a file"});
  EXPECT_EQ(reportsOf("dbl(1) > /tmp/list.txt").size(), 1U);
}

TEST(VxWorksLineTest, NamesTheColumnOfAnError) {
  EXPECT_EQ(reportsOf("f(1,2"), Texts{"1:6 error expected a comma or ), found the end of the "
                                      "line"});
  EXPECT_EQ(reportsOf("f(\"a)"), Texts{"1:3 error the string is not closed: write \" at its end"});
  EXPECT_EQ(reportsOf("f 1 2"),
            Texts{"1:5 error expected a comma or the end of the line, found a number"});
  EXPECT_EQ(reportsOf("x = nothing"), Texts{"1:5 error undefined symbol nothing"});
  EXPECT_EQ(reportsOf("x = 1 +"), Texts{"1:8 error expected a value, found the end of the "
                                        "line"});
  EXPECT_EQ(reportsOf("f(1,,2)"), Texts{"1:5 warning an argument is missing here; it counts as 0"});
  for (const auto* line : {"f(1))", "f(1) g", "= 1", "x =", "1 = 2", "&", "f(&1)", "<", "five / 0",
                           "f (1), 2", "1 + nothing", "(", "f(1;2)", "ld <", "five 1 2"})
    EXPECT_EQ(reportsOf(line).size(), 1U) << line;
}

TEST(VxWorksLineTest, RefusesDeepExpressions) {
  for (const auto* part : {"(", "-", "f(", "x=", "1+(", "(int)"}) {
    std::string line = "x = ";
    for (int i = 0; i < 10000; ++i) line += part;
    ASSERT_EQ(reportsOf(line).size(), 1U) << part;
    EXPECT_NE(reportsOf(line).front().find("nested"), std::string::npos) << part;
  }
}

TEST(VxWorksLineTest, WarnsAboutMoreThanTenArguments) {
  EXPECT_EQ(reportsOf("f(1,2,3,4,5,6,7,8,9,10)"), Texts{});
  EXPECT_EQ(reportsOf("f(1,2,3,4,5,6,7,8,9,10,11)"),
            Texts{"1:24 warning vxWorks passes only the first 10 arguments"});
}

}  // namespace
}  // namespace mpf::test
