// SPDX-License-Identifier: MIT
// The stderr of a supervisor: readers that hang, that are slow, and that have gone.
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <string>

#include <mpf/file_descriptor.h>

#include "tests/crate/supervisor/supervisor_fixture.h"

namespace mpf::crate::test {
namespace {

class SupervisorOutputTest : public SupervisorTest {
 protected:
  // Runs a crate of one server whose stderr is redirected, and waits until the server is ready.
  void runTo(const std::string& redirection) {
    write("[[server]]\nprogram = \"int32\"\n");
    start({"/bin/bash", "-c",
           std::string("exec ") + MPF + " run " + files_.file("lab.toml") + " " + redirection});
    waitForState("int32", "ready");
  }
  // The same with a pipe that is full.
  void runToFullPipe() {
    const auto path = files_.file("errors");
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    pipe_.reset(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    while (::write(pipe_.get(), "-", 1) == 1) continue;
    runTo("2>" + path);
  }
  void killServer() {
    const auto before = pidOf("int32");
    ::kill(before, SIGKILL);
    waitForNew("int32", before);
  }
  // Reads the pipe until `last` comes.
  std::string readUntil(const std::string& last) {
    std::string text;
    std::array<char, 65536> bytes{};
    pollfd polled{pipe_.get(), POLLIN, 0};
    while (text.find(last) == std::string::npos) {
      ::poll(&polled, 1, -1);
      const auto length = ::read(pipe_.get(), bytes.data(), bytes.size());
      if (length > 0) text.append(bytes.data(), static_cast<std::size_t>(length));
    }
    return text;
  }

  FileDescriptor pipe_;
};

// Lines that differ only in digits would be folded.
std::string lettersOf(int number) {
  std::string letters;
  for (int digits = 0; digits < 4; ++digits, number /= 26)
    letters += static_cast<char>('a' + number % 26);
  return letters;
}

TEST_F(SupervisorOutputTest, RestartsAProcessWhileNobodyReads) {
  runToFullPipe();

  killServer();

  EXPECT_EQ(WEXITSTATUS(stop()), 0);
}

TEST_F(SupervisorOutputTest, ASlowReaderGetsEachLineOfALog) {
  constexpr int kLines = 3000;
  runToFullPipe();
  {
    std::ofstream log(folder().log("int32"), std::ios::app);
    for (int i = 0; i < kLines; ++i) log << lettersOf(i) << std::string(1000, '=') << '\n';
    log << "the last line\n";
  }
  killServer();  // the supervisor works meanwhile

  const auto text = readUntil("the last line");
  for (int i = 0; i < kLines; ++i)
    ASSERT_THAT(text, testing::HasSubstr("int32 | " + lettersOf(i) + "="));
}

TEST_F(SupervisorOutputTest, ContinuesWithoutAReader) {
  runTo("2> >(exec true)");  // the reader of the pipe ends at once

  EXPECT_EQ(WEXITSTATUS(stop()), 0);
}

TEST_F(SupervisorOutputTest, PrintsTheLinesOfLogsIfTheUserHasNoInotifyInstanceLeft) {
  write(kServer);
  // NOLINTNEXTLINE(bugprone-suspicious-missing-comma): one argument
  start({"/usr/bin/env", "LD_PRELOAD=" MPF_TEST_NO_INOTIFY, MPF, "run", files_.file("lab.toml")});

  EXPECT_THAT(supervisor_->waitForLine("serving \"Int32\""), testing::StartsWith("int32 | "));
  waitForState("int32", "ready");
}

}  // namespace
}  // namespace mpf::crate::test
