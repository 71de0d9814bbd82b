// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <string>

#include "tests/crate/startup/shell/shell_scene.h"

namespace mpf::test {
namespace {

TEST(StringFunctionsTest, BuildLongMacroStrings) {
  ShellScene scene;

  scene.run(
      "str=malloc(256)\nstrcpy(str,\"P=a,\")\nstrcat(str,\"R=b\")\nf(str, strlen(str))\n"
      "free(str)\n");

  EXPECT_EQ(scene.calls, Texts{"f(\"P=a,R=b\", 7)"});
  EXPECT_EQ(scene.reports(), Texts{});
}

TEST(StringFunctionsTest, SharePointersAsC) {
  ShellScene scene;

  scene.run("a = malloc(20); b = a; strcpy a,\"abc\"; strcpy(b+1,\"X\"); f(a,b)\n");

  EXPECT_EQ(scene.calls, Texts{"f(\"aX\", \"aX\")"});
}

TEST(StringFunctionsTest, FormatNumbersAndStrings) {
  ShellScene scene;

  scene.run(
      "s = malloc(99); sprintf(s, \"%s%d:%02x %5.2f%% %c%ld\", \"a\", 7, 10, 1.5, 'z', 3); "
      "f(s)\n");

  EXPECT_EQ(scene.calls, Texts{"f(\"a7:0a  1.50% z3\")"});
  EXPECT_EQ(scene.reports(), Texts{});
}

TEST(StringFunctionsTest, AllocateNothing) {
  ShellScene scene;

  scene.run("m = malloc(1024*1024*1024*1024)\nfree(m)\nn = calloc(1000000000, 1000000000)\n");

  EXPECT_EQ(scene.reports(), Texts{});
}

TEST(StringFunctionsTest, WarnAboutOverrunsAndFreedMemory) {
  ShellScene scene;

  scene.run("s = malloc(4)\nstrcpy(s, \"abcd\")\nfree(s)\nfree(s)\nstrcpy(s, \"\")\n");

  EXPECT_EQ(scene.reports(), (Texts{"2:8 warning strcpy writes 5 bytes into 4: allocate more",
                                    "4:6 warning this memory is already free",
                                    "5:8 warning strcpy writes into memory that is free"}));
}

TEST(StringFunctionsTest, LimitTheLengthOfStrings) {
  ShellScene scene;
  std::string text = "s = malloc(1000000); strcpy(s, \"0123456789abcdef\")\n";
  for (int i = 0; i < 20; ++i) text += "strcat(s, s)\n";

  scene.run(text);

  EXPECT_EQ(scene.shell.diagnostics().count(startup::Severity::error), 8U);
}

TEST(StringFunctionsTest, RefuseOtherArguments) {
  for (const auto* line :
       {"strcpy(nothing, \"a\")", "strcpy(0, \"a\")", "strlen(5)", "malloc(-1)",
        "s=malloc(9);sprintf(s,\"%s\",1)", "s=malloc(9);sprintf(s,\"%n\",1)",
        "s=malloc(9);sprintf(s,\"%d\",\"a\")", "free(5)", "s=malloc(9);sprintf(s,\"%99999999d\",1)",
        "s=malloc(9);sprintf(s,\"%\")"}) {
    ShellScene scene;
    scene.run(std::string(line) + "\n");
    EXPECT_EQ(scene.shell.diagnostics().count(startup::Severity::error), 1U) << line;
  }
}

}  // namespace
}  // namespace mpf::test
