// SPDX-License-Identifier: MIT
// Peers that are programs of their own: their protocol, and what happens when they fail. The
// programs of these tests are shell scripts.
#include "benchmarks/peers/external_peer.h"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "benchmarks/peers/mpf_peer.h"
#include "tests/support/temporary_folder.h"

namespace mpf::bench {
namespace {

using testing::HasSubstr;

const std::string kReadyServer = "echo ready; cat > /dev/null";

class ExternalPeer : public testing::Test {
 protected:
  // Runs `server` and `requester`, which are shell commands; they find the words of the protocol in
  // $*, and the name of the row in $name.
  Outcome run(const std::string& server, const std::string& requester,
              Nanoseconds grace = std::chrono::seconds(60)) {
    const auto script =
        folder_.write("peer",
                      "for word; do case $word in name=*) name=${word#name=};; esac; done\n"
                      "case $* in role=server*) " +
                          server + ";; *) " + requester + ";; esac\n");
    const auto cpu = allowedCpus().front();
    const Stage stage({{cpu}, {cpu}}, {Nanoseconds(1000), Nanoseconds(2000)});
    return runExternal(stage, {{"/bin/sh", script}, {}, grace}, {"outstanding", 7}, options());
  }
  [[nodiscard]] static PeerOptions options() {
    return {Mode::block, 1024, true, kRunPrefix + std::to_string(::getpid()) + "-1"};
  }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream file(folder_.file(name));
    return {std::istreambuf_iterator<char>(file), {}};
  }
  // Whether the process whose pid is in this file has ended.
  [[nodiscard]] bool hasEnded(const std::string& file) const {
    return ::kill(std::stoi(read(file)), 0) != 0 && errno == ESRCH;
  }

  const test::TemporaryFolder folder_;
};

TEST_F(ExternalPeer, ReportsFigures) {
  const auto outcome =
      run(kReadyServer, "echo latency 200 3; echo latency 400 1; echo typical 250.5");

  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(outcome.figures.latency.count(), 4u);
  EXPECT_EQ(outcome.figures.latency.percentileNs(50), 200u);
  EXPECT_EQ(outcome.figures.latency.maxNs(), 400u);
  EXPECT_EQ(outcome.figures.typicalNs, 250.5);
}

TEST_F(ExternalPeer, ReportsARate) {
  const auto outcome = run(kReadyServer, "echo rate 1000 500000");

  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(outcome.figures.count, 1000u);
  EXPECT_EQ(outcome.figures.perSecond, 2e6);
}

TEST_F(ExternalPeer, IsToldWhatToMeasure) {
  const auto outcome = run(kReadyServer, "echo $* > " + folder_.file("words") + "; echo rate 1 1");

  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(read("words"),
            "role=requester work=outstanding mode=block bytes=1024 touch=1 window=7 name=" +
                options().name + " warmUpNs=1000 measureNs=2000\n");
}

TEST_F(ExternalPeer, StartsTheRequesterWhenTheServerIsReady) {
  const auto mark = folder_.file("mark");

  const auto outcome =
      run("echo > " + mark + "; " + kReadyServer, "test -e " + mark + " && echo rate 1 1");

  EXPECT_EQ(outcome.error, "");
}

TEST_F(ExternalPeer, ClosesTheInputOfTheServerAtTheEnd) {
  const auto outcome = run(kReadyServer + "; echo > " + folder_.file("ended"), "echo rate 1 1");

  EXPECT_EQ(outcome.error, "");
  EXPECT_TRUE(std::filesystem::exists(folder_.file("ended")));
}

TEST_F(ExternalPeer, ShowsTheLastWordsOfAProgramThatFails) {
  const auto outcome = run(kReadyServer, "echo no such service >&2; exit 3");

  EXPECT_THAT(outcome.error, HasSubstr("ended with status 3: no such service"));
}

TEST_F(ExternalPeer, FailsWithoutFigures) {
  EXPECT_THAT(run(kReadyServer, "echo latency many").error,
              HasSubstr("reported no figures: latency many"));
}

TEST_F(ExternalPeer, FailsWhenTheServerEndsEarly) {
  EXPECT_THAT(run("echo ready", "cat").error, HasSubstr("ended before it was asked to"));
  EXPECT_THAT(run("echo ready; kill -9 $$", "cat").error, HasSubstr("killed by signal 9"));
}

TEST_F(ExternalPeer, FailsWhenTheProgramDoesNotExist) {
  const auto cpu = allowedCpus().front();
  const Stage stage({{cpu}, {cpu}}, {});

  const auto outcome = runExternal(stage, {{folder_.file("none")}, {}}, {}, options());

  EXPECT_THAT(outcome.error, HasSubstr("could not be executed"));
}

// Both programs write their pids and files, and hang.
TEST_F(ExternalPeer, LeavesNothingBehindWhenItHangs) {
  const auto pid = folder_.file("pid");
  const std::string hang =
      "echo > /dev/shm/$name.left; mkdir -p /tmp/$name.left/folder; exec sleep 1000";

  // On a busy host the time may pass before both have started.
  for (auto limit = std::chrono::seconds(1); read("pid.requester").empty(); limit *= 2) {
    const auto outcome = run("echo $$ > " + pid + ".server; echo ready; " + hang,
                             "echo $$ > " + pid + ".requester; " + hang, limit);
    EXPECT_THAT(outcome.error, HasSubstr("neither process ended within"));
  }

  EXPECT_TRUE(hasEnded("pid.server"));
  EXPECT_TRUE(hasEnded("pid.requester"));
  for (const std::string folder : {"/dev/shm/", "/tmp/"})
    EXPECT_FALSE(std::filesystem::exists(folder + options().name + ".left"));
}

TEST(ExternalFiles, OfDeadRunsAreRemoved) {
  const auto dead = forkProcess([] {});
  while (!hasEnded(dead)) sleepFor(std::chrono::milliseconds(1));
  const auto fileOf = [](int pid) {
    return "/dev/shm/" + std::string(kRunPrefix) + std::to_string(pid) + "-1.left";
  };
  for (const auto pid : {dead, ::getpid()}) std::ofstream(fileOf(pid)) << "x";

  removeFilesOfDeadRuns();

  EXPECT_FALSE(std::filesystem::exists(fileOf(dead)));
  EXPECT_TRUE(std::filesystem::remove(fileOf(::getpid())));
}

TEST(ExternalReport, IgnoresOtherLines) {
  Figures figures;
  for (const char* line : {"", "latency", "latency 5", "latency 5 6 7", "latency -5 1", "rate 1 0",
                           "typical fast", "typical", "Picked up JAVA_TOOL_OPTIONS: 5"})
    EXPECT_FALSE(applyReport(line, figures)) << line;

  EXPECT_EQ(figures.latency.count(), 0u);
}

}  // namespace
}  // namespace mpf::bench
