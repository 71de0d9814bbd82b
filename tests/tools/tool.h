// SPDX-License-Identifier: MIT
// Tool: runs the program `mpf` in a process of its own, which dies with the test.
//
//   Tool sniff({"sniff", "serial[0]"}, backplane.name());
//   sniff.line();                       // reads stdout line by line
//   const auto end = sniff.end();       // waits: exit status, the rest of stdout, all of stderr
//
// Threads  one.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::test {

// How a program ended, and its output.
struct Ended {
  int status = 0;  // exit status, or minus the number of the signal that killed it
  std::string out;
  std::string err;
};

class Tool {
 public:
  // Runs `mpf` with these arguments and $MPF_BACKPLANE = backplane; empty: without the variable.
  // `user`: the user to run as, for tests that run as root.
  Tool(std::vector<std::string> arguments, const std::string& backplane, uid_t user = ::geteuid())
      : err_(::memfd_create("stderr", MFD_CLOEXEC)) {
    checkCall(err_.get(), "memfd_create");
    std::array<int, 2> pipe{};
    checkCall(::pipe2(pipe.data(), O_CLOEXEC), "pipe2");
    out_.reset(pipe[0]);
    const FileDescriptor input(pipe[1]);
    const FileDescriptor nothing(
        checkCall(::open("/dev/null", O_RDONLY | O_CLOEXEC), "open", "/dev/null"));
    std::string program = MPF_TEST_TOOL;
    std::vector<char*> argv{program.data()};
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    auto variables = environment(backplane);
    std::vector<char*> envp;
    for (auto& variable : variables) envp.push_back(variable.data());
    envp.push_back(nullptr);
    pid_ = checkCall(::fork(), "fork");
    if (pid_ != 0) return;
    if (user != ::geteuid() && ::setuid(user) != 0) ::_exit(125);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::dup2(nothing.get(), STDIN_FILENO);
    ::dup2(input.get(), STDOUT_FILENO);
    ::dup2(err_.get(), STDERR_FILENO);
    ::execve(program.c_str(), argv.data(), envp.data());
    ::_exit(126);
  }
  ~Tool() {
    if (pid_ == 0) return;
    signal(SIGKILL);
    wait();
  }
  Tool(const Tool&) = delete;
  Tool& operator=(const Tool&) = delete;

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  void signal(int number) const { ::kill(pid_, number); }
  // Waits for the next line on stdout, without its newline; empty after the end of the output.
  std::string line() {
    for (;;) {
      if (const auto end = read_.find('\n'); end != std::string::npos) {
        auto line = read_.substr(0, end);
        read_.erase(0, end + 1);
        return line;
      }
      if (!readMore()) return {};
    }
  }
  // Waits for a line that contains `text`, and returns it; empty when the output ends before.
  std::string lineWith(const std::string& text) {
    for (auto next = line(); !next.empty() || !isOver_; next = line()) {
      if (next.find(text) != std::string::npos) return next;
    }
    return {};
  }
  // Closes the end of the pipe at which its stdout is read.
  void closeOutput() { out_.reset(); }
  // What it has written to stderr until now.
  [[nodiscard]] std::string err() const {
    std::string text(static_cast<std::size_t>(checkCall(::lseek(err_.get(), 0, SEEK_END), "lseek")),
                     '\0');
    text.resize(static_cast<std::size_t>(
        checkCall(::pread(err_.get(), text.data(), text.size(), 0), "pread")));
    return text;
  }
  // Waits until the program has ended.
  Ended end() {
    while (readMore()) continue;
    Ended ended;
    const int status = wait();
    ended.status = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    ended.out = std::exchange(read_, {});
    ended.err = err();
    return ended;
  }

 private:
  static std::vector<std::string> environment(const std::string& backplane) {
    std::vector<std::string> variables;
    for (char** variable = environ; *variable != nullptr; ++variable) {
      const std::string text = *variable;
      if (!text.starts_with("MPF_") && !text.starts_with("TZ=")) variables.push_back(text);
    }
    variables.emplace_back("TZ=UTC");
    if (!backplane.empty()) variables.push_back("MPF_BACKPLANE=" + backplane);
    return variables;
  }
  bool readMore() {
    std::array<char, 4096> bytes{};
    const auto got =
        retryInterrupted([&] { return ::read(out_.get(), bytes.data(), bytes.size()); });
    if (got > 0) read_.append(bytes.data(), static_cast<std::size_t>(got));
    else isOver_ = true;
    return got > 0;
  }
  int wait() {
    int status = 0;
    ::waitpid(std::exchange(pid_, 0), &status, 0);
    return status;
  }

  pid_t pid_ = 0;
  FileDescriptor out_;
  FileDescriptor err_;
  std::string read_;
  bool isOver_ = false;
};

// Runs `mpf` and waits for its end.
inline Ended runTool(std::vector<std::string> arguments, const std::string& backplane) {
  return Tool(std::move(arguments), backplane).end();
}

}  // namespace mpf::test
