// SPDX-License-Identifier: MIT
// NameWatch: tells which names appeared in /dev/shm since it was asked last.
//
// Threads  one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

namespace mpf::tools {

class NameWatch {
 public:
  // A user has few inotify instances (128 by default): without one it tells nothing, and waits all
  // the same.
  NameWatch();

  // Names since the last call. nullopt: some were lost, or it cannot tell: look at them all.
  [[nodiscard]] std::optional<std::vector<std::string>> take();
  // Returns when there are new names, or after `limit`; a signal ends it, too.
  void wait(Nanoseconds limit) const noexcept;

 private:
  FileDescriptor inotify_;
};

}  // namespace mpf::tools
