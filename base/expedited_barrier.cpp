// SPDX-License-Identifier: MIT
#include "base/expedited_barrier.h"

#include <linux/membarrier.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>

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

}  // namespace

bool tryRegister() noexcept {
  static const bool kIsRegistered = canRegister();
  return kIsRegistered;
}

void acrossProcesses() noexcept {
  if (!tryCommand(MEMBARRIER_CMD_GLOBAL_EXPEDITED)) std::abort();
}

void inThisProcess() noexcept {
  if (!tryCommand(MEMBARRIER_CMD_PRIVATE_EXPEDITED)) std::abort();
}

}  // namespace mpf::expedited_barrier
