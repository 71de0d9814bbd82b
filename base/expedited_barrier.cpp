// SPDX-License-Identifier: MIT
#include "base/expedited_barrier.h"

#include <linux/membarrier.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "base/print_error.h"

namespace mpf::expedited_barrier {
namespace {

#ifdef __SANITIZE_THREAD__
constexpr bool kIsModelled = false;
#else
constexpr bool kIsModelled = true;
#endif

enum class Registration { notTried, done, refused };
std::atomic<Registration> registration{Registration::notTried};

bool tryCommand(membarrier_cmd command) noexcept {
  return ::syscall(SYS_membarrier, command, 0, 0) == 0;
}

// Executing both kinds once shows that no filter refuses them.
bool canRegister() noexcept {
  return kIsModelled && tryCommand(MEMBARRIER_CMD_REGISTER_GLOBAL_EXPEDITED) &&
         tryCommand(MEMBARRIER_CMD_REGISTER_PRIVATE_EXPEDITED) &&
         tryCommand(MEMBARRIER_CMD_GLOBAL_EXPEDITED) &&
         tryCommand(MEMBARRIER_CMD_PRIVATE_EXPEDITED);
}

void execute(membarrier_cmd command) noexcept {
  if (tryCommand(command)) return;
  printError(
      "mpf: membarrier() worked when this process started and is refused now: {}. Let the filter "
      "of system calls (seccomp) allow it, or install the filter before MPF is used.\n",
      std::strerror(errno));
  std::abort();
}

}  // namespace

// Two threads may register at once. A static variable of this function would make the child of a
// fork wait for a thread of its parent that initialized it meanwhile, which takes milliseconds.
bool tryRegister() noexcept {
  auto known = registration.load(std::memory_order_relaxed);
  if (known == Registration::notTried) {
    known = canRegister() ? Registration::done : Registration::refused;
    registration.store(known, std::memory_order_relaxed);
  }
  return known == Registration::done;
}

void acrossProcesses() noexcept { execute(MEMBARRIER_CMD_GLOBAL_EXPEDITED); }
void inThisProcess() noexcept { execute(MEMBARRIER_CMD_PRIVATE_EXPEDITED); }

}  // namespace mpf::expedited_barrier
