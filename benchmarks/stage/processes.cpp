// SPDX-License-Identifier: MIT
#include "benchmarks/stage/processes.h"

#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>

#include "base/print_error.h"
#include "base/system_call.h"
#include "base/timespec.h"

namespace mpf::bench {

void pinTo(const Cpus& cpus) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const auto cpu : cpus) CPU_SET(static_cast<std::size_t>(cpu), &set);
  checkCall(::sched_setaffinity(0, sizeof set, &set), "sched_setaffinity", "CPU " + toString(cpus));
}

std::string toString(const Cpus& cpus) {
  std::string text;
  for (const auto cpu : cpus) text += (text.empty() ? "" : ", ") + std::to_string(cpu);
  return text;
}

Cpus allowedCpus() {
  cpu_set_t set;
  CPU_ZERO(&set);
  checkCall(::sched_getaffinity(0, sizeof set, &set), "sched_getaffinity");
  Cpus cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &set)) cpus.push_back(cpu);
  }
  return cpus;
}

int forkProcess(const std::function<void()>& body) {
  const auto parent = ::getpid();
  const auto pid = checkCall(::fork(), "fork", "a benchmark process");
  if (pid != 0) return pid;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) std::_Exit(1);
  body();
  std::_Exit(0);
}

int startProgram(std::vector<std::string> words, const std::function<void()>& prepare) {
  return forkProcess([&] {
    try {
      prepare();
    } catch (const std::exception& exception) {
      printError("{}\n", exception.what());
      std::_Exit(1);
    }
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    ::execvp(arguments[0], arguments.data());
    printError("{}: {}\n", arguments[0], std::strerror(errno));
    std::_Exit(kNoSuchProgram);
  });
}

void killProcess(int pid) noexcept {
  if (pid <= 0) return;
  ::kill(pid, SIGKILL);
  retryInterrupted([&] { return ::waitpid(pid, nullptr, 0); });
}

bool hasEnded(int pid) noexcept { return ::waitpid(pid, nullptr, WNOHANG) != 0; }

void sleepFor(Nanoseconds duration) {
  const auto pause = timespecOf(duration);
  ::nanosleep(&pause, nullptr);
}

bool waitUntil(const std::function<bool()>& done, Nanoseconds limit) {
  const auto deadline = Deadline::after(limit);
  while (!done()) {
    if (deadline.hasPassed()) return false;
    sleepFor(std::chrono::microseconds(200));
  }
  return true;
}

}  // namespace mpf::bench
