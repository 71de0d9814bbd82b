// SPDX-License-Identifier: MIT
// mpf run and mpf new: names that cannot be names of folders and files.
#include <sys/wait.h>

#include <filesystem>

#include "tests/crate/supervisor/supervisor_fixture.h"

namespace mpf::crate::test {
namespace {

using testing::HasSubstr;

class RunTest : public SupervisorTest {
 protected:
  mpf::test::EndedCommand mpf(const std::string& arguments) {
    return mpf::test::runCommand(
        fmt::format("cd {} && {} {} 2>&1", files_.path().string(), MPF, arguments));
  }
};

TEST_F(RunTest, RefusesANameThatLeavesTheFolderOfCrates) {
  write(kServer);
  for (const std::string option : {"", " --check", " --dry-run"}) {
    const auto result = mpf("run --name ../../x lab.toml" + option);

    EXPECT_EQ(WEXITSTATUS(result.status), 2);
    EXPECT_THAT(result.output, HasSubstr("--name \"../../x\": use 1 to 100 characters"));
  }
  EXPECT_EQ(mpf("run --name x --check lab.toml").status, 0);
}

TEST_F(RunTest, ANewCrateHasANameThatItsCheckAccepts) {
  for (const std::string name : {"'a b'", "''", ".a", "a/"}) {
    const auto result = mpf("new crate " + name);

    EXPECT_EQ(WEXITSTATUS(result.status), 2) << name;
    EXPECT_THAT(result.output, HasSubstr("use 1 to 100 characters"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(files_.path()));
  std::filesystem::create_directory(files_.path() / "folder");
  EXPECT_EQ(mpf("new crate folder/a").status, 0);
  EXPECT_EQ(mpf("run --check folder/a.toml").status, 0);
}

}  // namespace
}  // namespace mpf::crate::test
