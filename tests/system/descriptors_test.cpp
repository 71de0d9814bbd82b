// SPDX-License-Identifier: MIT
// Every program, started with some standard descriptors closed or full: it exits with the
// documented status, opens /dev/null in place of closed descriptors, and never writes its log to an
// instrument.
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

#include <mpf/file_descriptor.h>
#include <mpf/serial_commands.h>
#include <mpf/sync_client.h>

#include "base/system_call.h"
#include "tests/support/program.h"
#include "tests/support/pty.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

constexpr unsigned kSubsets = 8;  // of the descriptors 0 to 2: bit n stands for descriptor n

// A program with some standard descriptors closed and others on files. It dies with the test.
class Bare {
 public:
  using Files = std::map<int,
                         // The file for each open descriptor; closed ones are missing.
                         const char*>;

  Bare(std::vector<std::string> command, unsigned closed, const Files& files = {}) {
    std::vector<char*> arguments;
    for (auto& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    std::array<int, 2> pipe{};
    checkCall(::pipe2(pipe.data(), O_CLOEXEC), "pipe2");
    const FileDescriptor started(pipe[0]);
    FileDescriptor writeEnd(pipe[1]);
    pid_ = checkCall(::fork(), "fork");
    if (pid_ != 0) {
      writeEnd.reset();
      char none = 0;
      // Closed when the program has been executed.
      [[maybe_unused]] const auto nothing = ::read(started.get(), &none, 1);
      return;
    }
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (int descriptor = 0; descriptor < 3; ++descriptor) {
      const auto found = files.find(descriptor);
      ::dup2(::open(found == files.end() ? "/dev/zero" : found->second, O_RDWR | O_CLOEXEC),
             descriptor);
    }
    for (int descriptor = 0; descriptor < 3; ++descriptor) {
      if ((closed >> descriptor & 1u) != 0) ::close(descriptor);
    }
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  ~Bare() {
    if (pid_ == 0) return;
    ::kill(pid_, SIGKILL);
    wait();
  }
  Bare(const Bare&) = delete;
  Bare& operator=(const Bare&) = delete;

  void signal(int number) const { ::kill(pid_, number); }
  // Waits for the end. Returns the exit status, or minus the number of the signal.
  int wait() {
    int status = 0;
    checkCall(::waitpid(std::exchange(pid_, 0), &status, 0), "waitpid");
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  // The file of a descriptor; empty while it is closed.
  [[nodiscard]] std::string placeOf(int descriptor) const {
    std::error_code none;
    return std::filesystem::read_symlink(fmt::format("/proc/{}/fd/{}", pid_, descriptor), none)
        .string();
  }
  // Waits until each of these descriptors is /dev/null. False when the program ends first.
  [[nodiscard]] bool waitForNull(unsigned descriptors) const {
    for (int descriptor = 0; descriptor < 3; ++descriptor) {
      while ((descriptors >> descriptor & 1u) != 0 && placeOf(descriptor) != "/dev/null") {
        if (hasEnded()) return false;
        ::sched_yield();
      }
    }
    return true;
  }

 private:
  [[nodiscard]] bool hasEnded() const {
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == pid_;
  }
  pid_t pid_ = 0;
};

std::vector<std::string> programs() {
  std::istringstream list(MPF_TEST_PROGRAMS);
  return {std::istream_iterator<std::string>(list), {}};
}

std::string fileName(const std::string& program) {
  return std::filesystem::path(program).filename().string();
}

class EveryProgramStarted : public testing::TestWithParam<std::string> {
 protected:
  // Arguments with which the program runs until a signal ends it.
  [[nodiscard]] std::vector<std::string> longRun() const {
    const std::map<std::string, std::vector<std::string>> arguments{
        {"mpf", {"tap", "nobody", "--backplane", backplane_.name()}},
        {"mpf-bench", {"local", "--quick", "--only", "futex bounce", "--json", fifo_}},
        {"mpf-torture", {"--json", fifo_}},
        {"mpf-ioc", {fifo_}},
        {"mpf-crate", {"run", fifo_}},
        {"mpf-router",
         {"--listen", "127.0.0.1:0", "--serve", "0", "--plain", "--backplane", backplane_.name()}},
        {"mpf-serial-server", {"line", linkPath_, "1000", "20", "--backplane", backplane_.name()}},
        {"mpf-gpib-server",
         {"gpib", "module", "--ti9914", "module,ipac,IP_a,105", "--carrier", "ipac=model",
          "--backplane", backplane_.name()}},
        {"mpf-int32-client", {"nobody", "--timeout", "1000", "--backplane", backplane_.name()}},
        {"mpf-char8-array-client",
         {"nobody", "--timeout", "1000", "--backplane", backplane_.name()}},
        {"mpf-dac128v-server",
         {"dac", "ipac", "IP_a", "20", "--carrier", "ipac=model", "--backplane",
          backplane_.name()}},
        {"mpf-ip330-server",
         {"adc", "ipac", "IP_a", "D", "-5to5", "0", "15", "10", "120", "--carrier", "ipac=model",
          "--backplane", backplane_.name()}},
        {"mpf-digital-io-server",
         {"dio", "ipac", "IP_a", "20", "100", "116", "0xff", "0xff", "--carrier", "ipac=model",
          "--backplane", backplane_.name()}},
        {"mpf-ip440-server",
         {"in", "ipac", "IP_a", "20", "--carrier", "ipac=model", "--backplane", backplane_.name()}},
        {"mpf-int32-server", {"--backplane", backplane_.name()}},
        {"mpf-char8-array-server", {"--backplane", backplane_.name()}},
        {"mpf-demo",
         {"--seconds", "1000000", "--patience", "1000000", "--backplane", backplane_.name()}}};
    auto command = arguments.at(fileName(GetParam()));
    command.insert(command.begin(), GetParam());
    return command;
  }

  Watchdog watchdog_{"a program"};
  TestBackplane backplane_;
  TemporaryFolder folder_;
  std::string linkPath_ = folder_.file("tty");
  Pty line_{linkPath_};
  std::string fifo_ = [this] {
    auto path = folder_.file("fifo.toml");  // a crate file for mpf-crate
    checkCall(::mkfifo(path.c_str(), 0600), "mkfifo", path);
    return path;
  }();
};

TEST_P(EveryProgramStarted, ExitsAsDocumentedWithClosedDescriptors) {
  for (unsigned closed = 0; closed < kSubsets; ++closed) {
    EXPECT_EQ(Bare({GetParam(), "--version"}, closed).wait(), 0) << closed;
    EXPECT_EQ(Bare({GetParam(), "--no-such-option"}, closed).wait(), 2) << closed;
  }
}

TEST_P(EveryProgramStarted, ExitsAsDocumentedWhenOutputCannotBeWritten) {
  EXPECT_EQ(Bare({GetParam(), "--version"}, 0, {{2, "/dev/full"}}).wait(), 0);
  EXPECT_EQ(Bare({GetParam(), "--no-such-option"}, 0, {{2, "/dev/full"}}).wait(), 2);
  EXPECT_EQ(Bare({GetParam(), "--version"}, 0, {{1, "/dev/full"}}).wait(), 1);
  EXPECT_EQ(Bare({GetParam(), "--version"}, 0, {{1, "/dev/full"}, {2, "/dev/full"}}).wait(), 1);
}

TEST_P(EveryProgramStarted, OpensDevNullForClosedDescriptors) {
  for (unsigned closed = 1; closed < kSubsets; ++closed) {
    Bare program(longRun(), closed);

    // A file that the program opened itself would stay.
    ASSERT_TRUE(program.waitForNull(closed)) << closed;

    for (int descriptor = 0; descriptor < 3; ++descriptor) {
      EXPECT_EQ(program.placeOf(descriptor),
                (closed >> descriptor & 1u) != 0 ? "/dev/null" : "/dev/zero")
          << closed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Programs, EveryProgramStarted, testing::ValuesIn(programs()),
                         [](const auto& test) {
                           auto name = fileName(test.param);
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

// Reads what an instrument at the remote end of a line receives until the server has ended.
class SerialServerWithout : public testing::TestWithParam<unsigned> {
 protected:
  Watchdog watchdog_{"a serial server"};
  TestBackplane backplane_;
  TemporaryFolder folder_;
  std::string linkPath_ = folder_.file("tty");
  Pty line_{linkPath_};
};

TEST_P(SerialServerWithout, SendsNoLineOfItsLogToTheInstrument) {
  Bare server({MPF_TEST_SERIAL_SERVER, "line", linkPath_, "1000", "20", "--log-level", "trace",
               "--backplane", backplane_.name()},
              GetParam());
  {
    SyncClient client(backplane_, "line");
    auto write = Char8ArrayMessage::allocValue(5);
    write->cmd = serial::cmdWrite;
    std::ranges::copy(std::string_view("*IDN?"), write.value().begin());
    ASSERT_TRUE(client.call(std::move(write), std::chrono::seconds(100)));
  }

  server.signal(SIGTERM);

  EXPECT_EQ(server.wait(), 0);  // the log has been written
  std::array<char, 1000> bytes{};
  pollfd poll{line_.master().get(), POLLIN, 0};
  const auto received =
      ::poll(&poll, 1, 0) == 1 ? ::read(line_.master().get(), bytes.data(), bytes.size()) : 0;
  EXPECT_EQ(std::string(bytes.data(), static_cast<std::size_t>(received)), "*IDN?");
}

TEST(LogOfAProgram, EscapesUntrustedText) {
  const Watchdog watchdog("a program");
  const TestBackplane backplane;
  const Program server({MPF_TEST_INT32_SERVER, "a\u202eb", "--backplane", backplane.name()});

  EXPECT_THAT(server.line(),
              testing::EndsWith(R"(info mpf-int32-server: serving "a\u202eb" at location 0)"));
}

INSTANTIATE_TEST_SUITE_P(Descriptors, SerialServerWithout, testing::Range(0U, kSubsets));

}  // namespace
}  // namespace mpf::test
