// SPDX-License-Identifier: MIT
// Program: a program of the project as a process of its own, with what it wrote to stderr. It dies with the test.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <mpf/base/file_descriptor.h>
#include <mpf/base/system_call.h>

namespace mpf::test {

class Program {
 public:
  // Starts `command`: a path and its arguments.
  explicit Program(std::vector<std::string> command) { start(command); }
  ~Program() {
    if (pid_ != 0) end(SIGKILL);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void signal(int number) const { ::kill(pid_, number); }
  // Waits for its end. Returns the status of waitpid().
  int wait() {
    int status = 0;
    checkCall(::waitpid(std::exchange(pid_, 0), &status, 0), "waitpid");
    return status;
  }
  int end(int number) {
    signal(number);
    return wait();
  }
  // Waits for the next line on stderr, without its end; empty when there is none any more.
  [[nodiscard]] std::string line() const {
    std::string text;
    for (char next = 0; retryInterrupted([&] { return ::read(errors_.get(), &next, 1); }) == 1 && next != '\n';) text += next;
    return text;
  }
  // Reads what it wrote to stderr; waits for its end.
  [[nodiscard]] std::string errors() const {
    std::string text;
    std::array<char, 4096> bytes{};
    for (;;) {
      const auto length = retryInterrupted([&] { return ::read(errors_.get(), bytes.data(), bytes.size()); });
      if (length <= 0) return text;
      text.append(bytes.data(), static_cast<std::size_t>(length));
    }
  }

 private:
  void start(std::vector<std::string>& command) {
    std::vector<char*> arguments;
    arguments.reserve(command.size() + 1);
    for (auto& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    std::array<int, 2> pipe{};
    checkCall(::pipe2(pipe.data(), O_CLOEXEC), "pipe2");
    errors_.reset(pipe[0]);
    const FileDescriptor writeEnd(pipe[1]);
    pid_ = checkCall(::fork(), "fork");
    if (pid_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::dup2(writeEnd.get(), STDERR_FILENO);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  FileDescriptor errors_;
  pid_t pid_ = 0;
};

}  // namespace mpf::test
