// SPDX-License-Identifier: MIT
// printError() and writeError(), in a child process whose stderr is captured or cannot be written.
#include "base/print_error.h"

#include <sched.h>
#include <signal.h>
#include <sys/ioctl.h>

#include <array>
#include <gtest/gtest.h>

#include "tests/base/child_process.h"

namespace mpf {
namespace {

using test::endOf;
using test::Errors;

constexpr int kReturned = 44;

// What `act` writes to stderr.
std::string errorsOf(const std::function<void()>& act) {
  const Errors errors;
  EXPECT_EQ(endOf([&] { return errors.take(), act(), kReturned; }), kReturned);
  return errors.text();
}

TEST(PrintError, WritesAFormattedMessage) {
  EXPECT_EQ(errorsOf([] { printError("mpf-x: {}: error {}\n", "a file", 7); }),
            "mpf-x: a file: error 7\n");
}

// The text of another process could control the terminal. Line ends stay.
TEST(PrintError, EscapesControlCharactersButNotLineEnds) {
  EXPECT_EQ(errorsOf([] { printError("one {}\ntwo {}\n", "\x1b[2J", "\xff\r"); }),
            "one \\x1b[2J\ntwo \\xff\\r\n");
}

TEST(WriteError, WritesBytesUnchanged) {
  EXPECT_EQ(errorsOf([] { writeError("\r\x1b[K\xff"); }), "\r\x1b[K\xff");
}

// A signal ends write() when a part of the message is in the pipe, and the pipe is full.
TEST(WriteError, ContinuesAfterAPartialWrite) {
  std::array<int, 2> ends{};
  checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
  FileDescriptor reader(ends[0]);
  FileDescriptor writer(ends[1]);
  const int capacity = checkCall(::fcntl(writer.get(), F_GETPIPE_SZ), "fcntl", "the pipe");
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    ::signal(SIGUSR1, [](int) {});
    ::dup2(writer.get(), STDERR_FILENO);
    writeError(std::string(3 * static_cast<std::size_t>(capacity), 'x'));
    ::_exit(kReturned);
  }
  writer.reset();
  for (int waiting = 0; waiting < capacity; ::sched_yield())
    checkCall(::ioctl(reader.get(), FIONREAD, &waiting), "ioctl", "the pipe");
  ::kill(child, SIGUSR1);

  std::size_t received = 0;
  std::array<char, 4096> bytes{};
  for (ssize_t got = 0; (got = ::read(reader.get(), bytes.data(), bytes.size())) > 0;)
    received += static_cast<std::size_t>(got);

  int status = 0;
  checkCall(::waitpid(child, &status, 0), "waitpid");
  EXPECT_EQ(received, 3 * static_cast<std::size_t>(capacity));
  EXPECT_EQ(WEXITSTATUS(status), kReturned);
}

TEST(PrintError, LosesAMessageThatCannotBeWritten) {
  const auto print = [] {
    printError("lost\n");
    return kReturned;
  };

  EXPECT_EQ(endOf([&] { return test::closeAll(4), print(); }), kReturned) << "closed";
  EXPECT_EQ(endOf([&] { return test::redirect(STDERR_FILENO, "/dev/full"), print(); }), kReturned)
      << "full";
  EXPECT_EQ(endOf([&] {
              ::signal(SIGPIPE, SIG_IGN);
              std::array<int, 2> ends{};
              if (::pipe(ends.data()) != 0) return 1;
              ::dup2(ends[1], STDERR_FILENO);
              ::close(ends[0]);
              ::close(ends[1]);
              return print();
            }),
            kReturned)
      << "a pipe without a reader";
}

}  // namespace
}  // namespace mpf
