// SPDX-License-Identifier: MIT
// Reads from the window of a server how many alarms it has counted, as `mpf msr` does.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include <mpf/backplane.h>
#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "shm/layout.h"

namespace mpf::test {

// The alarm count of `server` at location 0. The name must not need an escape in a file name.
inline std::uint64_t alarmsOf(const Backplane& backplane, const std::string& server) {
  const auto path = "/dev/shm/mpf." + backplane.name() + ".s.0." + server;
  const FileDescriptor window(checkCall(::open(path.c_str(), O_RDONLY | O_CLOEXEC), "open", path));
  std::uint64_t alarms = 0;
  constexpr auto kAt =
      static_cast<off_t>(layout::kWindowControlOffset + offsetof(layout::WindowControl, alarms));
  checkCall(::pread(window.get(), &alarms, sizeof alarms, kAt), "pread", path);
  return alarms;
}

}  // namespace mpf::test
