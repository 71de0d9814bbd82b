// SPDX-License-Identifier: MIT
// Child: a forked process that takes part in a test and may be killed at any point. It is killed at
// the end of the test.
//
//   Child child([&](Child::Self& self) {
//     auto segment = ...;
//     self.stay();          // notifies the parent that it is ready; never returns
//   });
//
// A child cannot use the MPF objects that the test made before: see shm/fork_guard.h.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <exception>
#include <functional>
#include <stdexcept>
#include <utility>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::test {

class Child {
 public:
  // The child's end.
  class Self {
   public:
    Self(FileDescriptor toParent, FileDescriptor fromParent)
        : toParent_(std::move(toParent)), fromParent_(std::move(fromParent)) {}
    // Notifies the parent, and continues when the parent calls go().
    void ready() {
      const char one = 1;
      if (::write(toParent_.get(), &one, 1) != 1) ::_exit(3);
      char go = 0;
      if (retryInterrupted([&] { return ::read(fromParent_.get(), &go, 1); }) != 1) ::_exit(0);
    }
    [[noreturn]] void stay() {
      for (;;) ready();
    }

   private:
    FileDescriptor toParent_;
    FileDescriptor fromParent_;
  };

  // Returns when the child is ready for the first time.
  //   throws  std::runtime_error if it ended before
  explicit Child(const std::function<void(Self&)>& run) {
    auto [fromChild, toParent] = pipe();
    auto [fromParent, toChild] = pipe();
    pid_ = checkCall(::fork(), "fork");
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      fromChild.reset();
      toChild.reset();
      Self self(std::move(toParent), std::move(fromParent));
      try {
        run(self);
      } catch (const std::exception& error) {
        std::fprintf(stderr, "child: %s\n", error.what());
        ::_exit(2);
      }
      ::_exit(0);
    }
    fromChild_ = std::move(fromChild);
    toChild_ = std::move(toChild);
    toParent.reset();
    if (!waitUntilReady()) throw std::runtime_error("the child ended before it was ready");
  }
  ~Child() { end(SIGKILL); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  // Lets a ready child continue.
  void go() const {
    const char one = 1;
    checkCall(::write(toChild_.get(), &one, 1), "write");
  }
  // Returns false if the child ended instead.
  [[nodiscard]] bool waitUntilReady() const {
    char ready = 0;
    return retryInterrupted([&] { return ::read(fromChild_.get(), &ready, 1); }) == 1;
  }
  // Stops it; returns when it has stopped.
  void stop() const {
    ::kill(pid_, SIGSTOP);
    int status = 0;
    ::waitpid(pid_, &status, WUNTRACED);
  }
  void resume() const { ::kill(pid_, SIGCONT); }
  // Sends the signal (0: none) and waits for the end. Returns the status of waitpid().
  int end(int signal) {
    if (pid_ == 0) return 0;
    if (signal != 0) ::kill(pid_, signal);
    int status = 0;
    ::waitpid(std::exchange(pid_, 0), &status, 0);
    return status;
  }

 private:
  static std::pair<FileDescriptor, FileDescriptor> pipe() {
    std::array<int, 2> ends{};
    checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
    return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
  }
  pid_t pid_ = 0;
  FileDescriptor fromChild_;
  FileDescriptor toChild_;
};

}  // namespace mpf::test
