// SPDX-License-Identifier: MIT
// Supervisor: the ends of its processes, and its own.
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <string>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "base/whole_file.h"
#include "tests/crate/supervisor/supervisor_fixture.h"

// NOLINTBEGIN(modernize-raw-string-literal): a crate is one line
namespace mpf::crate::test {
namespace {

using testing::HasSubstr;

class SupervisorEndTest : public SupervisorTest {
 protected:
  // The entry of a program that runs this script in the folder of the test.
  std::string program(const std::string& script) {
    return "[[program]]\nname = \"shell\"\ncommand = [\"sh\", \"-c\", \"" + script +
           "\"]\nworking-folder = \"" + files_.path().string() + "\"\n";
  }
  void waitForFile(const std::string& name) {
    while (::access(files_.file(name).c_str(), F_OK) != 0) continue;
  }
};

// What a service manager receives.
class NotifiedSocket {
 public:
  NotifiedSocket() : socket_(checkCall(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0), "socket")) {
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
    socklen_t length = offsetof(sockaddr_un, sun_path);  // the kernel chooses an abstract name
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    checkCall(::bind(socket_.get(), generic, length), "bind");
    length = sizeof address;
    checkCall(::getsockname(socket_.get(), generic, &length), "getsockname");
    name_ = "@" + std::string(address.sun_path + 1, length - offsetof(sockaddr_un, sun_path) - 1);
  }
  [[nodiscard]] const std::string& name() const { return name_; }
  void waitFor(const std::string& report) const {
    while (next().find(report) == std::string::npos) continue;
  }

 private:
  [[nodiscard]] std::string next() const {
    std::array<char, 4096> bytes{};
    const auto length = checkCall(::recv(socket_.get(), bytes.data(), bytes.size(), 0), "recv");
    return {bytes.data(), static_cast<std::size_t>(length)};
  }
  FileDescriptor socket_;
  std::string name_;
};

TEST_F(SupervisorEndTest, KillsWhatAProcessLeavesBehind) {
  run(program("sleep 1000 & echo $! >left; mv left pid; exec sleep 1001"));
  waitForFile("pid");
  const auto left = std::stoi(readWholeFile(files_.file("pid")));
  EXPECT_EQ(::kill(left, 0), 0);

  ask({{"do", "stop"}, {"name", "shell"}});

  while (::kill(left, 0) == 0) continue;
}

TEST_F(SupervisorEndTest, PrintsALastLineWithoutAnEnd) {
  run(program("printf 'last words'; exit 3") + "restart = \"never\"\n");

  EXPECT_THAT(supervisor_->waitForLine("last words"), HasSubstr("shell | last words"));
}

// A user repeats `mpf stop` when a process takes long to end.
TEST_F(SupervisorEndTest, ASecondRequestToStopKillsNothing) {
  run(program("trap '' TERM; : >trapped; while [ ! -e go ]; do sleep 0.01; done; : >done"));
  waitForFile("trapped");

  ask({{"do", "shutdown"}});
  ask({{"do", "shutdown"}});
  waitForState("shell", "stopping");
  static_cast<void>(files_.write("go", ""));

  EXPECT_EQ(WEXITSTATUS(supervisor_->wait()), 0);
  supervisor_.reset();
  EXPECT_EQ(::access(files_.file("done").c_str(), F_OK), 0) << "the process was killed";
}

// The time that the processes may take to end is longer than systemd waits without such reports.
TEST_F(SupervisorEndTest, TellsSystemdThatItStillStops) {
  const NotifiedSocket systemd;
  ::setenv("NOTIFY_SOCKET", systemd.name().c_str(), 1);
  run(program("trap '' TERM; : >trapped; while :; do sleep 1000; done"));
  ::unsetenv("NOTIFY_SOCKET");
  systemd.waitFor("READY=1");
  waitForFile("trapped");

  supervisor_->signal(SIGTERM);

  systemd.waitFor("STOPPING=1");
  for (int i = 0; i < 3; ++i) systemd.waitFor("EXTEND_TIMEOUT_USEC=30000000");
  EXPECT_EQ(stateOf("shell"), "stopping");
  EXPECT_EQ(WEXITSTATUS(stop()), 0) << "the second signal kills at once";
}

TEST_F(SupervisorEndTest, RestartsAProcessAlthoughItsParentIgnoresTheEndsOfChildren) {
  write(kServer);
  start({"/usr/bin/env", "--ignore-signal=CHLD", MPF, "run", files_.file("lab.toml")});
  waitForState("int32", "ready");
  const auto before = pidOf("int32");

  ::kill(before, SIGKILL);

  waitForNew("int32", before);
}

}  // namespace
}  // namespace mpf::crate::test
// NOLINTEND(modernize-raw-string-literal)
