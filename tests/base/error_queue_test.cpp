// SPDX-License-Identifier: MIT
// ErrorQueue: readers of stderr that hang, that go on, and that have gone.
#include "base/error_queue.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <string>

#include "base/print_error.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::EndsWith;
using testing::StartsWith;

// While it exists, stderr is another file.
class StderrTo {
 public:
  explicit StderrTo(int file) : before_(::dup(STDERR_FILENO)) { ::dup2(file, STDERR_FILENO); }
  ~StderrTo() { ::dup2(before_.get(), STDERR_FILENO); }
  StderrTo(const StderrTo&) = delete;
  StderrTo& operator=(const StderrTo&) = delete;

 private:
  FileDescriptor before_;
};

// stderr is a pipe, and the test reads it.
class ErrorQueueTest : public testing::Test {
 protected:
  ErrorQueueTest() {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
    reader_.reset(ends[0]);
    writer_.reset(ends[1]);
    stderr_.emplace(writer_.get());
    queue_.emplace();
  }
  // Prints numbered lines until one is kept; returns how many.
  int fill() {
    int lines = 0;
    while (queue_->descriptor() < 0) printError("{}\n", lines++);
    return lines;
  }
  // What can be read now.
  std::string read() {
    std::string text;
    std::array<char, 65536> bytes{};
    pollfd polled{reader_.get(), POLLIN, 0};
    while (::poll(&polled, 1, 0) > 0 && (polled.revents & POLLIN) != 0)
      text.append(bytes.data(),
                  static_cast<std::size_t>(::read(reader_.get(), bytes.data(), bytes.size())));
    return text;
  }
  static std::string numbers(int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += std::to_string(i) + "\n";
    return text;
  }

  const Watchdog watchdog_{"ErrorQueue"};
  FileDescriptor reader_;
  FileDescriptor writer_;
  std::optional<StderrTo> stderr_;
  std::optional<ErrorQueue> queue_;
};

TEST_F(ErrorQueueTest, WhatAReaderDoesNotTakeIsWrittenLaterInOrder) {
  const int lines = fill();

  auto text = read();
  queue_->flush();
  text += read();

  EXPECT_EQ(text, numbers(lines));
  EXPECT_LT(queue_->descriptor(), 0);
}

TEST_F(ErrorQueueTest, MessagesBeyondTheLimitAreCounted) {
  fill();
  const std::string large(ErrorQueue::kMaxBytes / 2 + 1, 'x');
  writeError(large);
  writeError(large + "\n");
  writeError("two\nlines\n");

  std::string text;
  while (queue_->descriptor() >= 0) {
    text += read();
    queue_->flush();
  }
  text += read();
  writeError("next\n");

  EXPECT_EQ(std::ranges::count(text, 'x'), static_cast<std::ptrdiff_t>(large.size()));
  EXPECT_THAT(text, EndsWith("x3 lines are missing here: the reader of stderr was too slow\n"));
  EXPECT_EQ(read(), "next\n");
}

TEST_F(ErrorQueueTest, AMessageMayBeLongerThanTheLimit) {
  const std::string large(3 * ErrorQueue::kMaxBytes, 'x');
  writeError(large);

  auto text = read();
  while (!queue_->isEmpty()) {
    queue_->flush();
    text += read();
  }
  EXPECT_EQ(text, large);
}

TEST_F(ErrorQueueTest, AReaderThatHasGoneTakesNothing) {
  fill();
  const auto before = ::signal(SIGPIPE, SIG_IGN);
  reader_.reset();
  queue_->flush();
  EXPECT_LT(queue_->descriptor(), 0);
  ::signal(SIGPIPE, before);
}

TEST_F(ErrorQueueTest, AtTheEndTheReaderGetsWhatIsKept) {
  const int lines = fill();
  auto text = read();
  queue_.reset();
  printError("direct\n");

  text += read();
  EXPECT_THAT(text, StartsWith(numbers(lines)));
  EXPECT_THAT(text, EndsWith("\ndirect\n"));
}

TEST_F(ErrorQueueTest, ATerminalThatIsStoppedKeepsNobodyWaiting) {
  const FileDescriptor screen(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  ASSERT_EQ(::grantpt(screen.get()), 0);
  ASSERT_EQ(::unlockpt(screen.get()), 0);
  const FileDescriptor terminal(::open(::ptsname(screen.get()), O_RDWR | O_NOCTTY | O_CLOEXEC));
  const StderrTo there(terminal.get());
  queue_.emplace();  // opens the terminal
  ASSERT_EQ(::tcflow(terminal.get(), TCOOFF), 0);  // as Ctrl-S does
  printError("one line\n");
  EXPECT_GE(queue_->descriptor(), 0);

  ASSERT_EQ(::tcflow(terminal.get(), TCOON), 0);
  queue_->flush();

  std::string text;
  for (char one = 0; one != '\n' && ::read(screen.get(), &one, 1) == 1;) text += one;
  EXPECT_EQ(text, "one line\r\n");
}

}  // namespace
}  // namespace mpf::test
