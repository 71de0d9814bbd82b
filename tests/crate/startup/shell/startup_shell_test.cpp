// SPDX-License-Identifier: MIT
#include <filesystem>
#include <gtest/gtest.h>
#include <string>

#include "tests/crate/startup/shell/shell_scene.h"

namespace mpf::test {
namespace {

using startup::Severity;
using startup::StartupShell;

TEST(StartupShellTest, ReportsAllMistakesOfAFile) {
  ShellScene scene;

  scene.run("f(1\r\ng(2)\r\nx = \r\nunknownCommand 1\r\n");

  EXPECT_EQ(scene.calls, Texts{"g(2)"});
  EXPECT_EQ(scene.reports(), (Texts{"1:4 error expected a comma or ), found the end of the line",
                                    "3:5 error expected a value, found the end of the line",
                                    "4:1 warning unknown command unknownCommand; it is skipped"}));
}

TEST(StartupShellTest, ResultOfAnUnknownCommandIsUnavailable) {
  ShellScene scene;

  scene.run("x = unknownCommand(1)\nf(x)\n");

  EXPECT_TRUE(scene.last.argument(0).is(startup::Value::Kind::unavailable));
  EXPECT_EQ(scene.reports().size(), 1U);
}

TEST(StartupShellTest, TellsTheHandlerThePlaceOfACommand) {
  ShellScene scene;
  scene.folder.write("b.cmd", "\n  f (1, nothing)\n");

  scene.run("routerInit\n< b.cmd\n");

  EXPECT_EQ(scene.last.place, (startup::Place{scene.folder.file("b.cmd"), 2, 3}));
  EXPECT_EQ(scene.last.includedFrom,
            (std::vector<startup::Place>{{scene.folder.file("st.cmd"), 2, 1}}));
  EXPECT_EQ(scene.last.text, "  f (1, nothing)");
  EXPECT_EQ(scene.last.arguments.at(1).column, 9U);
  EXPECT_EQ(scene.last.argument(1).name(), "nothing");
  EXPECT_EQ(scene.last.argument(7).integer(), 0);
}

TEST(StartupShellTest, HandlerReportsAtAnArgument) {
  ShellScene scene;
  scene.run("f(1, nothing)\n");

  scene.shell.reportArgument(Severity::error, scene.last, 1, "undefined symbol nothing");
  scene.shell.report(Severity::note, scene.last, "text");

  EXPECT_EQ(scene.reports(), (Texts{"1:6 error undefined symbol nothing", "1:1 note text"}));
}

TEST(StartupShellTest, IncludesFilesOfTheCurrentFolder) {
  ShellScene scene;
  std::filesystem::create_directories(scene.folder.path() / "a");
  scene.folder.write("a/b.cmd", "<../c.cmd\nf(x)\ncd \"..\"\n");
  scene.folder.write("c.cmd", "x = \"#.#\"\n");

  scene.run("cd \"a\"\n< b.cmd\n< c.cmd\ng(x)\n");

  EXPECT_EQ(scene.calls, (Texts{"f(\"#.#\")", "g(\"#.#\")"}));
  EXPECT_EQ(scene.reports(), Texts{});
}

TEST(StartupShellTest, MissingFileIsAnErrorUnlessEachSiteHasItsOwn) {
  ShellScene scene;

  scene.run("< cdCommands\n< ../nfsCommands\n< other.cmd\n<\n");

  EXPECT_EQ(scene.shell.diagnostics().count(Severity::note), 2U);
  EXPECT_EQ(scene.shell.diagnostics().count(Severity::error), 2U);
  EXPECT_EQ(scene.shell.diagnostics().all().at(2).place.line, 3U);
}

TEST(StartupShellTest, MissingFirstFileIsAnError) {
  ShellScene scene;

  scene.shell.execute("nothing.cmd");

  ASSERT_EQ(scene.shell.diagnostics().all().size(), 1U);
  EXPECT_NE(scene.shell.diagnostics().all().front().formatted().find(
                "nothing.cmd: error: the file does not exist"),
            std::string::npos);
}

TEST(StartupShellTest, FileThatIncludesItselfIsAnError) {
  ShellScene scene;
  scene.folder.write("b.cmd", "< ./st.cmd\nf\n");

  scene.run("< b.cmd\ng\n");

  EXPECT_EQ(scene.calls, (Texts{"f()", "g()"}));
  ASSERT_EQ(scene.reports().size(), 1U);
  EXPECT_NE(scene.reports().front().find("includes itself"), std::string::npos);
}

TEST(StartupShellTest, LimitsDepthAndNumberOfFiles) {
  ShellScene scene;
  for (int i = 0; i < 20; ++i) {
    std::string text;
    for (int n = 0; n < 4; ++n) text += "< f" + std::to_string(i + 1) + "\n";
    scene.folder.write("f" + std::to_string(i), text);
  }
  scene.folder.write("f20", "g\n");

  scene.run("< f0\n");

  EXPECT_TRUE(scene.calls.empty());
  EXPECT_TRUE(scene.shell.diagnostics().hasErrors());
}

TEST(StartupShellTest, RefusesWhatIsNoStartupFile) {
  ShellScene scene;
  std::filesystem::create_directories(scene.folder.path() / "folder");
  scene.folder.write("zero", std::string("a\0b\n", 4));
  scene.folder.write("long", std::string(StartupShell::Limits::kLineBytes + 1, 'a') + "\nf\n");

  scene.run("< folder\n< zero\n< long\ng \x01\nh\n");

  EXPECT_EQ(scene.calls, (Texts{"f()", "h()"}));
  EXPECT_EQ(scene.shell.diagnostics().count(Severity::error), 4U);
}

TEST(StartupShellTest, DetectsTheDialectOfEachFile) {
  ShellScene scene;
  scene.folder.write("b.cmd", "f A B\nvar x 1\n");

  scene.run("y = 2\n< b.cmd\nf(y)\n");

  EXPECT_EQ(scene.calls, (Texts{"f(\"A\", \"B\")", "f(2)"}));
  EXPECT_EQ(scene.reports(), Texts{});
}

TEST(StartupShellTest, SymbolsAreDefinedBeforeTheFile) {
  ShellScene scene;
  scene.shell.define("top", startup::Value::ofString("/top"));

  scene.run("f(top, NULL)\n");

  EXPECT_EQ(scene.calls, Texts{"f(\"/top\", 0)"});
}

}  // namespace
}  // namespace mpf::test
