// SPDX-License-Identifier: MIT
// NameWatch: reports which names have appeared in /dev/shm, by inotify.
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
  // A user has few inotify instances (128 by default). Without one, take() always returns nullopt,
  // and wait() waits for its limit.
  NameWatch();

  // Names that appeared since the last call. nullopt when some may be missing: the caller must then
  // look at all names.
  [[nodiscard]] std::optional<std::vector<std::string>> take();
  // Returns when there are new names, after `limit`, or on a signal.
  void wait(Nanoseconds limit) const noexcept;
  // Readable when there are new names; -1 without an inotify instance.
  [[nodiscard]] int descriptor() const noexcept { return inotify_ ? inotify_.get() : -1; }

 private:
  FileDescriptor inotify_;
};

}  // namespace mpf::tools
