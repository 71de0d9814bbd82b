// SPDX-License-Identifier: MIT
// Program: a program of the project as a process of its own, and its stderr. It is killed at the
// end of the test.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "tests/support/output.h"

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
  // Stops the process (SIGSTOP), and returns when it has stopped.
  void stop() const {
    signal(SIGSTOP);
    checkCall(::waitpid(pid_, nullptr, WUNTRACED), "waitpid");
  }
  // Waits until the process has ended. Returns the status of waitpid().
  int wait() {
    int status = 0;
    checkCall(::waitpid(std::exchange(pid_, 0), &status, 0), "waitpid");
    return status;
  }
  int end(int number) {
    signal(number);
    return wait();
  }
  // Whether the process has ended; wait() still returns its status.
  [[nodiscard]] bool hasEnded() const {
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == pid_;
  }
  // Waits for a line on stderr that contains `text`, and returns it without its line end. The line
  // may have been written before the call, because the order of lines of two threads is not
  // certain. Empty if the program ends without such a line.
  [[nodiscard]] std::string waitForLine(std::string_view text) const {
    return errors_->waitForLine(text);
  }
  // Waits for the next line on stderr; empty if the program has ended. Only for programs that write
  // all lines in one thread.
  [[nodiscard]] std::string line() const { return errors_->nextLine(); }
  // Waits for the end of stderr. Returns all that line() has not returned.
  [[nodiscard]] std::string errors() const { return errors_->rest(); }

 private:
  void start(std::vector<std::string>& command) {
    std::vector<char*> arguments;
    arguments.reserve(command.size() + 1);
    for (auto& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    std::array<int, 2> pipe{};
    checkCall(::pipe2(pipe.data(), O_CLOEXEC), "pipe2");
    FileDescriptor readEnd(pipe[0]);
    const FileDescriptor writeEnd(pipe[1]);
    pid_ = checkCall(::fork(), "fork");
    if (pid_ != 0) {
      errors_ = std::make_unique<Output>(std::move(readEnd));
      return;
    }
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::dup2(writeEnd.get(), STDERR_FILENO);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  std::unique_ptr<Output> errors_;
  pid_t pid_ = 0;
};

}  // namespace mpf::test
