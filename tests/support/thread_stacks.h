// SPDX-License-Identifier: MIT
// printThreadStacks(): the call stacks of all threads of this process, for a test that hangs.
#pragma once

#include <dirent.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <execinfo.h>
#include <thread>

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>
#endif

namespace mpf::test {

inline std::atomic<int>& printedStacks() {
  static std::atomic<int> theCount{0};
  return theCount;
}

inline void printThisStack(int = 0) {
  ::dprintf(STDERR_FILENO, "thread %ld\n", ::syscall(SYS_gettid));
#ifdef __SANITIZE_ADDRESS__
  __sanitizer_print_stack_trace();
#else
  std::array<void*, 50> frames{};
  ::backtrace_symbols_fd(frames.data(), ::backtrace(frames.data(), frames.size()), STDERR_FILENO);
#endif
  ++printedStacks();
}

// Writes to stderr. Called by a signal handler, it may wait for a lock that the hanging thread has:
// then SIGALRM ends the process after 30 s.
inline void printThreadStacks() {
  struct sigaction action{};
  ::sigaction(SIGALRM, &action, nullptr);  // the default: ends the process
  sigset_t alarm;
  ::sigemptyset(&alarm);
  ::sigaddset(&alarm, SIGALRM);
  ::pthread_sigmask(SIG_UNBLOCK, &alarm, nullptr);
  ::alarm(30);

  action.sa_handler = printThisStack;
  ::sigaction(SIGUSR2, &action, nullptr);
  auto* tasks = ::opendir("/proc/self/task");
  if (tasks == nullptr) return;
  while (const auto* task = ::readdir(tasks)) {
    const auto thread = std::atoi(task->d_name);
    if (thread == 0) continue;  // "." and ".."
    const auto before = printedStacks().load();
    if (::syscall(SYS_tgkill, ::getpid(), thread, SIGUSR2) != 0) continue;
    while (printedStacks() == before) std::this_thread::yield();
  }
  ::closedir(tasks);
}

}  // namespace mpf::test
