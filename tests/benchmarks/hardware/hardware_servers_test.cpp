// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "benchmarks/hardware/hardware.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::bench {
namespace {

using testing::HasSubstr;

// A program in place of a server: a shell script.
class HardwareServersTest : public testing::Test {
 protected:
  std::unique_ptr<HardwareServers> serversWith(const std::string& script) {
    program_ = folder_.write("server", "#!/bin/bash\n" + script + "\n");
    std::filesystem::permissions(program_, std::filesystem::perms::owner_all);
    const auto cpus = allowedCpus();
    return std::make_unique<HardwareServers>(Bench{"mpf-bench-test-" + std::to_string(::getpid()),
                                                   {{cpus.front()}, {cpus.back()}},
                                                   Mode::block},
                                             std::vector<std::string>{program_});
  }
  static Outcome failing() {
    Outcome outcome;
    outcome.error = "no end";
    return outcome;
  }
  test::TemporaryFolder folder_;
  std::string program_;
};

TEST_F(HardwareServersTest, NameAMissingProgram) {
  const HardwareServers servers({"mpf-bench-test", {}, Mode::block}, {"mpf-no-such-server"});

  EXPECT_THAT(servers.missing(), HasSubstr("does not exist"));
}

TEST_F(HardwareServersTest, AddTheOutputOfTheProgramToAnError) {
  const auto servers = serversWith("echo 'the board is hot' >&2; exec sleep 3600");
  servers->start();
  const test::Watchdog watchdog("a server that prints a line");

  // The script prints the line at an unknown time.
  while (servers->said().empty()) ::sched_yield();

  EXPECT_EQ(servers->run(failing).error,
            "no end; last output of " + program_ + ": the board is hot");
}

TEST_F(HardwareServersTest, RunNoRowOnceTheProgramHasEnded) {
  const auto servers = serversWith("echo 'an accident' >&2; exit 3");
  servers->start();
  const test::Watchdog watchdog("a server that ends");

  // The script ends at an unknown time.
  std::string error;
  while (error.empty()) error = servers->run([] { return Outcome{}; }).error;

  EXPECT_EQ(error, program_ + " has ended: an accident");
}

TEST_F(HardwareServersTest, EndAtTheirStop) {
  const auto servers = serversWith("exec sleep 3600");
  servers->start();
  const int pid = servers->pid();

  servers->stop();

  EXPECT_NE(::kill(pid, 0), 0);
  EXPECT_EQ(servers->pid(), 0);
}

}  // namespace
}  // namespace mpf::bench
