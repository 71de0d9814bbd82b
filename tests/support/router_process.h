// SPDX-License-Identifier: MIT
// RouterProcess: mpf-router as a process of its own, and its stderr. It is killed at the end of the
// test. If the test has failed, its whole stderr is printed.
//
// Threads  one thread.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <gtest/gtest.h>
#include <iostream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::test {

class RouterProcess {
 public:
  // Runs in the new process before it executes mpf-router: sets limits, enters namespaces.
  using Enter = std::function<void()>;

  // Starts the router with these options or with a file, its name first, and waits until it is
  // ready. listening() returns the addresses at which it listens.
  explicit RouterProcess(const std::vector<std::string>& options, const Enter& enter = {})
      : said_(checkCall(::memfd_create("stderr", MFD_CLOEXEC), "memfd_create")) {
    std::array<int, 2> pipe{};
    checkCall(::pipe2(pipe.data(), O_CLOEXEC), "pipe2");
    const FileDescriptor ready(pipe[0]);
    FileDescriptor told(pipe[1]);
    std::vector<std::string> words{MPF_TEST_ROUTER};
    words.insert(words.end(), options.begin(), options.end());
    if (options.front().starts_with("--")) addPatience(words);
    words.insert(words.end(), {"--ready-fd", std::to_string(kReadyFd)});
    std::vector<char*> argv;
    for (auto& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_ = checkCall(::fork(), "fork");
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (enter) enter();  // first, while its descriptors are still open under their numbers
      // dup2() of a descriptor to itself would keep its close-on-exec flag.
      const int told2 = ::fcntl(told.get(), F_DUPFD, kReadyFd + 1);
      ::dup2(said_.get(), STDERR_FILENO);
      ::dup2(told2, kReadyFd);
      ::close(told2);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    told.reset();
    for (char byte = 0; retryInterrupted([&] { return ::read(ready.get(), &byte, 1); }) == 1;)
      listening_ += byte;
  }
  ~RouterProcess() { end(SIGKILL); }
  RouterProcess(const RouterProcess&) = delete;
  RouterProcess& operator=(const RouterProcess&) = delete;

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  // The addresses at which the router listens, a line for each.
  [[nodiscard]] const std::string& listening() const noexcept { return listening_; }
  // All that it has written to stderr so far.
  [[nodiscard]] std::string said() const {
    std::string text(
        static_cast<std::size_t>(checkCall(::lseek(said_.get(), 0, SEEK_END), "lseek")), '\0');
    text.resize(static_cast<std::size_t>(
        checkCall(::pread(said_.get(), text.data(), text.size(), 0), "pread")));
    return text;
  }
  void waitUntilSaid(const std::string& text) const {
    while (said().find(text) == std::string::npos)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }

  void signal(int number) const { ::kill(pid_, number); }
  // Stops the process (SIGSTOP). After the return it does not run.
  void stop() {
    signal(SIGSTOP);
    ::waitpid(pid_, nullptr, WUNTRACED);
    stands_ = true;
  }
  // Continues the process, only if stop() has stopped it: LeakSanitizer stops a process at its exit
  // to examine it, and a SIGCONT would end that stop.
  void resume() {
    if (std::exchange(stands_, false)) signal(SIGCONT);
  }
  // Sends the signal and waits for the end. Returns the status of waitpid().
  int end(int number) {
    if (pid_ == 0) return 0;
    signal(number);
    resume();
    int status = 0;
    ::waitpid(std::exchange(pid_, 0), &status, 0);
    if (testing::Test::HasFailure()) std::cout << "router " << listening_ << said();
    return status;
  }

 private:
  // On a busy host, a router may get no processor for seconds. Only tests that set these times
  // themselves, also in a file, check them.
  static void addPatience(std::vector<std::string>& words) {
    for (const auto* const time : {"--dead-time", "--handshake-time"})
      if (std::ranges::find(words, time) == words.end()) words.insert(words.end(), {time, "60s"});
  }
  static constexpr int kReadyFd = 3;
  FileDescriptor said_;
  pid_t pid_ = 0;
  bool stands_ = false;
  std::string listening_;
};

}  // namespace mpf::test
