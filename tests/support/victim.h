// SPDX-License-Identifier: MIT
// Victim: a process with a role that a test kills, stops and starts. It is killed at the end of the
// test.
//
//   Victim server("serve", backplane.name());
//   server.line();                            // "open": the next line that the role prints
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <spawn.h>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::test {

// The number of kills in each test: MPF_TEST_KILLS, or `usual` if it is not set.
inline int killsOr(int usual) {
  const char* set = std::getenv("MPF_TEST_KILLS");
  return set != nullptr ? std::atoi(set) : usual;
}

class Victim {
 public:
  Victim() = default;
  // Runs tests/support/victim.cpp as `role` on `backplane`.
  Victim(const std::string& role, const std::string& backplane,
         const std::vector<std::string>& more = {})
      : Victim(MPF_TEST_VICTIM, [&] {
          std::vector<std::string> all{role, backplane};
          all.insert(all.end(), more.begin(), more.end());
          return all;
        }()) {}
  // Runs any program.
  Victim(std::string program, std::vector<std::string> words) {
    std::vector<char*> arguments{program.data()};
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    std::array<int, 2> pipe{};
    checkCall(::pipe2(pipe.data(), O_CLOEXEC), "pipe2");
    output_.reset(pipe[0]);
    const FileDescriptor input(pipe[1]);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, input.get(), STDOUT_FILENO);
    const int error =
        ::posix_spawn(&pid_, program.c_str(), &actions, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throwSystemError(error, "start", program);
  }
  Victim(Victim&& other) noexcept
      : pid_(std::exchange(other.pid_, 0)),
        output_(std::move(other.output_)),
        read_(std::exchange(other.read_, {})) {}
  Victim& operator=(Victim&& other) noexcept {
    end(SIGKILL);
    pid_ = std::exchange(other.pid_, 0);
    output_ = std::move(other.output_);
    read_ = std::exchange(other.read_, {});
    return *this;
  }
  ~Victim() { end(SIGKILL); }

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  // Waits for the next line that it prints; empty if it has ended.
  std::string line() {
    for (;;) {
      if (const auto end = read_.find('\n'); end != std::string::npos) {
        auto line = read_.substr(0, end);
        read_.erase(0, end + 1);
        return line;
      }
      std::array<char, 512> bytes{};
      const auto got =
          retryInterrupted([&] { return ::read(output_.get(), bytes.data(), bytes.size()); });
      if (got <= 0) return {};
      read_.append(bytes.data(), static_cast<std::size_t>(got));
    }
  }

  void signal(int number) const { ::kill(pid_, number); }
  // Stops the process, and returns when it has stopped: after the signal alone it may still run, on
  // another processor.
  void stop() const {
    signal(SIGSTOP);
    checkCall(::waitpid(pid_, nullptr, WUNTRACED), "waitpid");
  }
  // Sends the signal and waits for the end. Returns the status of waitpid().
  int end(int number) {
    if (pid_ == 0) return 0;
    signal(number);
    return wait();
  }
  // Waits for the end. Returns the status of waitpid().
  int wait() {
    int status = 0;
    ::waitpid(std::exchange(pid_, 0), &status, 0);
    return status;
  }

 private:
  pid_t pid_ = 0;
  FileDescriptor output_;
  std::string read_;
};

}  // namespace mpf::test
