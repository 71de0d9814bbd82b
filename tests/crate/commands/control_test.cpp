// SPDX-License-Identifier: MIT
// mpf stop, mpf start, mpf restart: their options, and names that no process has.
#include <sys/wait.h>

#include "tests/crate/supervisor/supervisor_fixture.h"

namespace mpf::crate::test {
namespace {

using mpf::test::runCommand;
using testing::HasSubstr;

using ControlTest = SupervisorTest;

TEST_F(ControlTest, RefusesATimeThatCannotBeWaitedFor) {
  for (const std::string time : {"inf", "nan", "1e300", "-1"}) {
    const auto result = runCommand(MPF " stop --wait " + time + " 2>&1");

    EXPECT_EQ(WEXITSTATUS(result.status), 2) << time;
    EXPECT_THAT(result.output, HasSubstr(time + " is not a time"));
  }
}

TEST_F(ControlTest, ANameThatIsNotUtf8IsUnknown) {
  run(kServer);

  const auto result = runCommand(MPF " stop \"$(printf '\\377')\" 2>&1");

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("the crate has no process"));
}

}  // namespace
}  // namespace mpf::crate::test
