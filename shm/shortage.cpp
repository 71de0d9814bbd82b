// SPDX-License-Identifier: MIT
#include "shm/shortage.h"

#include <cerrno>
#include <new>
#include <system_error>

namespace mpf {

using layout::Shortage;

Shortage shortageOf(const std::exception& error) noexcept {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) return Shortage::memory;
  const auto* failed = dynamic_cast<const std::system_error*>(&error);
  switch (failed != nullptr ? failed->code().value() : 0) {
    case EMFILE:
      return Shortage::descriptors;
    case ENFILE:
      return Shortage::openFiles;
    case ENOMEM:
      return Shortage::memory;
    case EAGAIN:
      return Shortage::threads;
    default:
      return Shortage::none;
  }
}

ShortageText textOf(Shortage shortage) noexcept {
  switch (shortage) {
    case Shortage::descriptors:
      return {"its process has no file descriptor left",
              "restart its process with a higher limit: ulimit -n 4096; LimitNOFILE=4096 in the "
              "systemd unit"};
    case Shortage::openFiles:
      return {"the host has no open file left", "sysctl fs.file-max=N, with a larger N than now"};
    case Shortage::memory:
      return {"no memory is left",
              "end programs that use much memory, or add memory; a limit of its process (ulimit "
              "-v, LimitAS=) may be too low, and with thousands of links vm.max_map_count"};
    case Shortage::threads:
      return {"its process can start no thread",
              "raise ulimit -u, or TasksMax= of the systemd unit; ulimit -v must allow for stacks"};
    case Shortage::none:
      break;
  }
  return {};
}

}  // namespace mpf
