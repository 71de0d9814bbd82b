// SPDX-License-Identifier: MIT
#include <filesystem>
#include <gtest/gtest.h>
#include <string>

#include "tests/crate/startup/shell/shell_scene.h"

namespace mpf::test {
namespace {

using startup::Value;

TEST(ShellCommandsTest, ChangeTheFolder) {
  ShellScene scene;
  std::filesystem::create_directories(scene.folder.path() / "a/b");
  scene.shell.define("topbin", Value::ofString("a"));

  scene.run("cd topbin\ncd \"b\"\ncd \"../b\"\n");
  EXPECT_EQ(scene.shell.folder(), scene.folder.path() / "a/b");
  EXPECT_EQ(scene.reports(), Texts{});
}

TEST(ShellCommandsTest, EmptyFolderIsTheFirstOne) {
  ShellScene scene;
  std::filesystem::create_directories(scene.folder.path() / "a");

  scene.run("cd \"a\"\ncd \"\"\n");

  EXPECT_EQ(scene.shell.folder(), scene.folder.path());
}

TEST(ShellCommandsTest, AbsentFolderIsAWarning) {
  ShellScene scene;

  scene.run("cd \"/does-not-exist\"\n");

  EXPECT_EQ(scene.shell.folder(), scene.folder.path());
  EXPECT_EQ(scene.shell.diagnostics().count(startup::Severity::warning), 1U);
}

TEST(ShellCommandsTest, UndefinedFolderIsAWarning) {
  ShellScene scene;

  scene.run("cd topbin\n");

  EXPECT_EQ(scene.shell.folder(), scene.folder.path());
  ASSERT_EQ(scene.shell.diagnostics().count(startup::Severity::warning), 1U);
  EXPECT_NE(scene.reports().front().find("1:4 warning undefined symbol topbin"), std::string::npos);
}

TEST(ShellCommandsTest, SetTheEnvironment) {
  ShellScene scene;

  scene.run("putenv(\"A=1\")\nputenv \"B=x=y\"\nepicsEnvSet(\"C\",\"3\")\nputenv \"D\"\n");

  EXPECT_EQ(scene.shell.environment().at("A"), "1");
  EXPECT_EQ(scene.shell.environment().at("B"), "x=y");
  EXPECT_EQ(scene.shell.environment().at("C"), "3");
  EXPECT_EQ(scene.reports(), Texts{"4:8 error putenv: \"NAME=VALUE\" is expected"});
}

TEST(ShellCommandsTest, SetVariablesOfIocsh) {
  ShellScene scene;

  scene.run("epicsEnvSet A B\nvar debug,$(X=2)\nvar other 3\nvar debug\nvar\n");

  EXPECT_EQ(scene.shell.environment().at("A"), "B");
  EXPECT_EQ(scene.shell.symbols().at("debug").integer(), 2);
  EXPECT_EQ(scene.shell.symbols().at("other").integer(), 3);
  EXPECT_EQ(scene.reports(), Texts{});
}

TEST(ShellCommandsTest, ExecuteOtherFiles) {
  ShellScene scene;
  scene.folder.write("b.cmd", "f 1\n");

  scene.run("iocshLoad(\"b.cmd\")\niocsh \"b.cmd\"\n");

  EXPECT_EQ(scene.calls, (Texts{"f(1)", "f(1)"}));
}

}  // namespace
}  // namespace mpf::test
