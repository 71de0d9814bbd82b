// SPDX-License-Identifier: MIT
// Victim: a process with a role, to be killed, stopped and started by a test. It dies with the test.
#pragma once

#include <signal.h>
#include <sys/wait.h>

#include <array>
#include <spawn.h>
#include <stdexcept>
#include <string>
#include <utility>

namespace mpf::test {

class Victim {
 public:
  Victim() = default;
  // Runs tests/support/victim.cpp as `role` on `backplane`.
  Victim(std::string role, std::string backplane) {
    std::string program = MPF_TEST_VICTIM;
    std::array<char*, 4> arguments{program.data(), role.data(), backplane.data(), nullptr};
    if (::posix_spawn(&pid_, program.c_str(), nullptr, nullptr, arguments.data(), environ) != 0) {
      throw std::runtime_error("cannot start " + program);
    }
  }
  Victim(Victim&& other) noexcept : pid_(std::exchange(other.pid_, 0)) {}
  Victim& operator=(Victim&& other) noexcept {
    end(SIGKILL);
    pid_ = std::exchange(other.pid_, 0);
    return *this;
  }
  ~Victim() { end(SIGKILL); }

  void signal(int number) const { ::kill(pid_, number); }
  // Sends the signal and waits for the end. Returns the status of waitpid().
  int end(int number) {
    if (pid_ == 0) return 0;
    signal(number);
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = 0;
    return status;
  }

 private:
  pid_t pid_ = 0;
};

}  // namespace mpf::test
