// SPDX-License-Identifier: MIT
// Processes and supervisors of a crate are killed, paused and ended at random, while clients on two
// backplanes call its servers. Each call has a reply, which is that of its request, or a stated
// fate; no process runs twice, and nothing is left.
//
//   MPF_TEST_FAULTS=20000 MPF_TEST_SEED=7 supervisor_test --gtest_filter='CrateTorture*'
#include <dirent.h>

#include <atomic>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <thread>

#include <mpf/sync_client.h>

#include "base/process_stat.h"
#include "base/program_beside.h"
#include "tests/crate/supervisor/supervisor_fixture.h"
#include "tests/support/router_pair.h"

namespace mpf::crate::test {
namespace {

using namespace std::chrono_literals;

unsigned settingOf(const char* variable, unsigned otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : static_cast<unsigned>(std::stoul(text));
}

// Calls a server until the end, and counts how the calls ended.
class Caller {
 public:
  Caller(const Backplane& backplane, std::string server, std::int32_t location)
      : backplane_(backplane),
        server_(std::move(server)),
        location_(location),
        thread_([this](const std::stop_token& stop) { call(stop); }) {}

  [[nodiscard]] std::string name() const { return fmt::format("{} {}", server_, location_); }
  [[nodiscard]] int replies() const { return replies_; }
  [[nodiscard]] int ends() const { return ends_; }

 private:
  void call(const std::stop_token& stop) {
    SyncClient client(backplane_, server_, location_);
    for (int value = 1; !stop.stop_requested(); ++value) {
      auto answer = client.call(Int32Message({.value = value}), 1s);
      if (const auto reply = answer.as<Int32>()) {
        EXPECT_EQ((*reply)->value, value) << name() << ": the reply to another request";
        ++replies_;
      } else {
        EXPECT_TRUE(answer.fate() || answer.refusal()) << name();
        ++ends_;
      }
    }
  }

  const Backplane& backplane_;
  const std::string server_;
  const std::int32_t location_;
  std::atomic<int> replies_{0}, ends_{0};
  std::jthread thread_;
};

// A file of a process; empty when it has ended.
std::string readOfProcess(pid_t pid, const char* file) {
  std::ostringstream content;
  content << std::ifstream(fmt::format("/proc/{}/{}", pid, file)).rdbuf();
  return content.str();
}

// The command lines of the processes on a backplane, by their pids.
std::map<pid_t, std::string> processesOn(const std::string& backplane) {
  std::map<pid_t, std::string> found;
  auto* const processes = ::opendir("/proc");
  while (const auto* entry = ::readdir(processes)) {
    const auto pid = std::atoi(entry->d_name);
    if (pid == 0 || pid == ::getpid()) continue;
    const auto command = readOfProcess(pid, "cmdline");
    if (command.find("mpf-") != std::string::npos &&
        readOfProcess(pid, "environ").find("MPF_BACKPLANE=" + backplane) != std::string::npos)
      found[pid] = command;
  }
  ::closedir(processes);
  return found;
}

class CrateTorture : public SupervisorTest {
 protected:
  void runCrate() {
    const auto server = [](const std::string& name) {
      return "[[server]]\nprogram = \"int32\"\nserver = \"" + name + "\"\n";
    };
    run(server("one") + server("two") + server("three") + R"(
[[server]]
program = "dac128v"
module = "dac"
carrier = "m"
site = "IP_a"
[[router]]
name = "near"
serve = "1=0"
plain = true
listen = ")" +
            port_.address() +
            R"("
[[program]]
name = "far"
notify = true
command = ["env", "MPF_BACKPLANE=)" +
            far_.name() + "\", \"" + programBeside("mpf-router") + R"(", "--plain", "--remote=1=)" +
            port_.address() + "\"]\n" + ioc() + "[carriers]\nm = \"model\"\n",
        "max-restarts = 1000000\n");
  }
  // An IOC with a record that asks the server "one", if the build has mpf-ioc.
  std::string ioc() {
    if (!std::filesystem::exists(std::filesystem::path(MPF).parent_path() / "mpf-ioc")) return "";
    names_.push_back("ioc");
    const auto database = files_.write("a.db", R"(record(longin, "one") {
      field(SCAN, ".1 second") field(DTYP, "MPF") field(INP, "@one type=int32") })");
    return "[[ioc]]\ndatabase = \"" + database + R"("
[ioc.environment]
EPICS_CAS_INTF_ADDR_LIST = "127.0.0.1"
EPICS_CAS_AUTO_BEACON_ADDR_LIST = "NO"
PVXS_QSRV_ENABLE = "NO"
)";
  }
  void waitForAll() {
    for (std::size_t i = 1; i < names_.size(); ++i) waitForState(names_[i], "ready");
  }

  // Does something to a random process, or to the supervisor.
  void strike(std::mt19937& random) {
    const auto victim = random() % names_.size();
    if (victim == 0) {
      ++faults_["supervisor killed"];
      killSupervisor();
      return run();
    }
    const auto pid = pidOf(names_[victim]);
    if (pid == 0) return;  // between its end and its restart
    switch (random() % 3) {
      case 0:
        ++faults_["killed"];
        ::kill(pid, SIGKILL);
        break;
      case 1:
        ++faults_["ended"];
        ::kill(pid, SIGTERM);
        break;
      default:
        ++faults_["paused"];
        ::kill(pid, SIGSTOP);
        std::this_thread::yield();
        ::kill(pid, SIGCONT);
    }
  }

  // No program of the crate runs twice. A process that has just ended may still be seen.
  void expectNoDoubles() {
    std::map<std::string, pid_t> seen;
    for (const auto& [pid, command] : processesOn(backplane_.name())) {
      const auto [other, isNew] = seen.emplace(command, pid);
      if (isNew || command.find("mpf-crate") != std::string::npos) continue;
      if (::kill(pid, 0) == 0 && ::kill(other->second, 0) == 0 && isAlive(pid) &&
          isAlive(other->second))
        ADD_FAILURE() << "two processes: " << pid << " and " << other->second << ": " << command;
    }
  }
  static bool isAlive(pid_t pid) {
    const auto stat = ProcessStat::tryRead(pid);
    return stat && !stat->hasEnded();
  }

  std::vector<std::string> names_{"supervisor", "one", "two", "three", "dac", "near", "far"};
  const mpf::test::TestBackplane far_;
  const mpf::test::FreePort port_;
  std::map<std::string, int> faults_;
};

TEST_F(CrateTorture, LosesNothingAndLeavesNothing) {
  const auto seed = settingOf("MPF_TEST_SEED", std::random_device()());
  std::cout << "MPF_TEST_SEED=" << seed << std::endl;
  std::mt19937 random(seed);
  runCrate();
  waitForAll();
  {
    std::vector<std::unique_ptr<Caller>> callers;
    for (const auto* const server : {"one", "two", "three"}) {
      callers.push_back(std::make_unique<Caller>(backplane_, server, 0));
      callers.push_back(std::make_unique<Caller>(far_, server, 1));
    }
    for (unsigned fault = 0; fault < settingOf("MPF_TEST_FAULTS", 60); ++fault) {
      watchdog_.emplace("CrateTorture");
      strike(random);
      expectNoDoubles();
    }
    waitForAll();
    // Each server is reached again, also from the other host.
    for (const auto& caller : callers) {
      const auto before = caller->replies();
      while (caller->replies() == before) std::this_thread::yield();
      std::cout << caller->name() << ": " << caller->replies() << " replies, " << caller->ends()
                << " other ends\n";
    }
  }

  EXPECT_EQ(WEXITSTATUS(stop()), 0);
  EXPECT_EQ(processesOn(backplane_.name()).size() + processesOn(far_.name()).size(), 0U);
  EXPECT_EQ(backplane_.segmentNames().size() + far_.segmentNames().size(), 0U);
  for (const auto& [what, count] : faults_) std::cout << what << ": " << count << "\n";
}

}  // namespace
}  // namespace mpf::crate::test
