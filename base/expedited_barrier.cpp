// SPDX-License-Identifier: MIT
#include "base/expedited_barrier.h"

#include <linux/membarrier.h>
#include <sys/syscall.h>
#include <unistd.h>

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
      "of "
      "system calls (seccomp) allow it, or install the filter before MPF is used.\n",
      std::strerror(errno));
  std::abort();
}

}  // namespace

bool tryRegister() noexcept {
  static const bool kIsRegistered = canRegister();
  return kIsRegistered;
}

void acrossProcesses() noexcept { execute(MEMBARRIER_CMD_GLOBAL_EXPEDITED); }
void inThisProcess() noexcept { execute(MEMBARRIER_CMD_PRIVATE_EXPEDITED); }

}  // namespace mpf::expedited_barrier
