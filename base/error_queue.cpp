// SPDX-License-Identifier: MIT
#include "base/error_queue.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <exception>
#include <fmt/format.h>

#include <mpf/clock.h>

#include "base/system_call.h"

namespace mpf {
namespace {

ErrorQueue* theQueue = nullptr;

// Files do not make a writer wait, and sockets cannot be opened again.
FileDescriptor tryReopenStderr() {
  struct stat status{};
  if (::fstat(STDERR_FILENO, &status) != 0) return {};
  if (!S_ISCHR(status.st_mode) && !S_ISFIFO(status.st_mode)) return {};
  return FileDescriptor(::open("/proc/self/fd/2", O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
}

// For a terminal or a pipe of another user, which cannot be opened again. A pipe that is ready
// accepts PIPE_BUF bytes; a terminal may accept less, and make us wait.
std::int64_t writeIfReady(std::string_view bytes) noexcept {
  pollfd polled{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&polled, 1, 0) == 0) {
    errno = EAGAIN;
    return -1;
  }
  return ::write(STDERR_FILENO, bytes.data(), std::min<std::size_t>(bytes.size(), PIPE_BUF));
}

}  // namespace

ErrorQueue::ErrorQueue() : reopened_(tryReopenStderr()) { theQueue = this; }

ErrorQueue::~ErrorQueue() {
  const auto deadline = Deadline::after(std::chrono::seconds(1));
  flush();
  while (!isEmpty() && !deadline.hasPassed()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline.left());
    pollfd polled{descriptor(), POLLOUT, 0};
    if (retryInterrupted([&] { return ::poll(&polled, 1, static_cast<int>(left.count())); }) <= 0)
      break;
    flush();
  }
  theQueue = nullptr;
}

ErrorQueue* ErrorQueue::current() noexcept { return theQueue; }

int ErrorQueue::descriptor() const noexcept {
  if (isEmpty()) return -1;
  return reopened_ ? reopened_.get() : STDERR_FILENO;
}

void ErrorQueue::write(std::string_view message) noexcept try {
  flush();
  // After a dropped one, others would come before the line that tells it.
  const bool isFull = !kept_.empty() && kept_.size() + message.size() > kMaxBytes;
  if (isFull || dropped_ != 0) return drop(message);
  kept_.append(message);
  tryWriteKept();
} catch (const std::exception&) {  // no memory
  drop(message);
}

void ErrorQueue::drop(std::string_view message) noexcept {
  dropped_ += static_cast<std::uint64_t>(std::ranges::count(message, '\n'));
}

void ErrorQueue::flush() noexcept try {
  tryWriteKept();
  if (dropped_ == 0 || !kept_.empty()) return;
  kept_ = fmt::format("{} lines are missing here: the reader of stderr was too slow\n", dropped_);
  dropped_ = 0;
  tryWriteKept();
  // NOLINTNEXTLINE(bugprone-empty-catch): no memory; the next call tries again
} catch (const std::exception&) {
}

void ErrorQueue::tryWriteKept() noexcept {
  std::string_view rest = kept_;
  while (!rest.empty()) {
    const auto written = tryWrite(rest);
    if (written < 0 && errno == EAGAIN) break;
    if (written <= 0) rest = {};  // closed, or without a reader: lost
    else rest.remove_prefix(static_cast<std::size_t>(written));
  }
  kept_.erase(0, kept_.size() - rest.size());
}

std::int64_t ErrorQueue::tryWrite(std::string_view bytes) const noexcept {
  return retryInterrupted([&]() noexcept -> std::int64_t {
    if (reopened_) return ::write(reopened_.get(), bytes.data(), bytes.size());
    const auto sent =
        ::send(STDERR_FILENO, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent >= 0 || errno != ENOTSOCK) return sent;
    return writeIfReady(bytes);
  });
}

}  // namespace mpf
