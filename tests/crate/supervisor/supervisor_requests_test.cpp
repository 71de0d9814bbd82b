// SPDX-License-Identifier: MIT
// Supervisor: requests to stop and start processes, and reloads.
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "base/toml/config_errors.h"
#include "crate/capsule/capsule_store.h"
#include "tests/crate/supervisor/supervisor_fixture.h"

// NOLINTBEGIN(modernize-raw-string-literal): a crate is one line
namespace mpf::crate::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

using SupervisorRequestsTest = SupervisorTest;

TEST_F(SupervisorRequestsTest, StopsAndStartsAProcess) {
  run(kServer);
  waitForState("int32", "ready");

  ask({{"do", "stop"}, {"name", "int32"}});
  waitForState("int32", "stopped");
  EXPECT_FALSE(isReplying("Int32", 1s));

  ask({{"do", "start"}, {"name", "int32"}});
  waitForState("int32", "ready");
  EXPECT_TRUE(isReplying("Int32"));
}

TEST_F(SupervisorRequestsTest, RefusesUnknownRequestsAndNames) {
  run(kServer);

  EXPECT_THAT([&] { ask({{"do", "stop"}, {"name", "int23"}}); },
              testing::ThrowsMessage<std::runtime_error>(
                  "the crate has no process \"int23\"; it has int32"));
  EXPECT_THAT([&] { ask({{"do", "dance"}, {"name", "int32"}}); },
              testing::ThrowsMessage<std::runtime_error>("unknown request \"dance\""));
  EXPECT_THROW(ask({{"name", "int32"}}), std::runtime_error);
}

TEST_F(SupervisorRequestsTest, AReloadThatFailsChangesNothing) {
  run(kServer);
  waitForState("int32", "ready");
  const auto pid = pidOf("int32");
  ASSERT_EQ(::symlink("/nonexistent/log", folder().log("two").c_str()), 0);
  write(std::string(kServer) + "[[server]]\nname = \"two\"\nprogram = \"int32\"\n");

  EXPECT_THROW(ask({{"do", "reload"}}), std::runtime_error);

  EXPECT_EQ(stateOf("int32"), "ready");
  EXPECT_EQ(pidOf("int32"), pid);
}

TEST_F(SupervisorRequestsTest, ReloadsOnlyWhatHasChanged) {
  run(kServer + kServer + "name = \"two\"\nserver = \"Two\"\n");
  waitForState("int32", "ready");
  waitForState("two", "ready");
  const auto one = pidOf("int32");
  const auto two = pidOf("two");

  write(kServer + kServer + "name = \"two\"\nserver = \"Two\"\nqueue-size = 7\n" + kServer +
        "name = \"three\"\nserver = \"Three\"\n");
  ask({{"do", "reload"}});
  waitForNew("two", two);
  waitForState("three", "ready");
  EXPECT_EQ(pidOf("int32"), one);

  write(kServer);
  ask({{"do", "reload"}});
  waitForState("two", "absent");
  waitForState("three", "absent");
  EXPECT_EQ(pidOf("int32"), one);
}

TEST_F(SupervisorRequestsTest, AReloadChangesTheLimitsOfLogsAndCapsules) {
  run(kServer);
  waitForState("int32", "ready");
  write("[logs]\nsize = \"64KiB\"\n[capsules]\ncount = 1\n" + kServer);

  ask({{"do", "reload"}});

  for (int i = 0; i < 2; ++i) {
    const auto before = pidOf("int32");
    ask({{"do", "restart"}, {"name", "int32"}});
    waitForNew("int32", before);
  }
  EXPECT_EQ(CapsuleStore(folder().file("capsules")).list().size(), 1U);
  const auto log = folder().log("int32");
  std::ofstream(log, std::ios::app) << std::string(1u << 20, '\n');
  struct stat status{};
  do {
    ASSERT_EQ(::stat(log.c_str(), &status), 0);
  } while (status.st_blocks * 512 > (1 << 20) - (1 << 18));
}

TEST_F(SupervisorRequestsTest, AnInvalidFileChangesNothing) {
  run(kServer);
  waitForState("int32", "ready");
  const auto one = pidOf("int32");
  write("[[server]]\nprogram = \"none\"\n");

  EXPECT_THAT([&] { ask({{"do", "reload"}}); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("unknown program \"none\"")));

  EXPECT_EQ(pidOf("int32"), one);
  EXPECT_EQ(stateOf("int32"), "ready");
}

TEST_F(SupervisorRequestsTest, AReloadStartsNoProcessThatTheUserHasStopped) {
  run(kServer + kServer + "name = \"two\"\nserver = \"Two\"\n");
  waitForState("int32", "ready");
  ask({{"do", "stop"}, {"name", "int32"}});
  waitForState("int32", "stopped");
  write(kServer + "queue-size = 7\n" + kServer +
        "name = \"two\"\nserver = \"Two\"\nqueue-size = 7\n");

  EXPECT_EQ(ask({{"do", "reload"}}).at("changed"), nlohmann::json::array({"two"}));

  EXPECT_EQ(stateOf("int32"), "stopped");
  ask({{"do", "start"}, {"name", "int32"}});
  waitForState("int32", "ready");
}

TEST_F(SupervisorRequestsTest, AReloadDoesNotRenameTheCrate) {
  run(kServer);
  waitForState("int32", "ready");
  const auto pid = pidOf("int32");
  static_cast<void>(files_.write("lab.toml", "name = \"new\"\n" + kServer + "queue-size = 7\n"));

  EXPECT_THAT([&] { ask({{"do", "reload"}}); },
              testing::ThrowsMessage<ConfigError>(HasSubstr(
                  "lab.toml:1:8: name: \"new\" was \"lab\"; a reload cannot rename a crate")));

  EXPECT_EQ(pidOf("int32"), pid);
  stop();
  start({MPF, "run", "--name", "lab", files_.file("lab.toml")});
  EXPECT_NO_THROW(ask({{"do", "reload"}}));
}

TEST_F(SupervisorRequestsTest, ATakenOverProcessThatTheCrateHasNoMoreIsEndedBesideNewOnes) {
  const std::string slow =
      "[[program]]\nname = \"slow\"\ncommand = [\"sh\", \"-c\", "
      "\"trap '' TERM; while :; do sleep 0.1; done\"]\n";
  run(kServer + slow);
  waitForState("int32", "ready");
  waitForState("slow", "ready");
  killSupervisor();

  run(kServer + kServer + "name = \"two\"\nserver = \"Two\"\n", "stop-time = \"1ms\"\n");

  waitForState("two", "ready");  // recorded while the other one ends
  waitForState("slow", "absent");
}

}  // namespace
}  // namespace mpf::crate::test
// NOLINTEND(modernize-raw-string-literal)
