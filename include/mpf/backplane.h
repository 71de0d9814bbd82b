// SPDX-License-Identifier: MIT
// Backplane: the named meeting place of a set of processes on one host. A cheap handle; copies
// share one watcher thread.
//
// Threads  any.
// Crash    attaching removes what dead processes left, after proof by their locks.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace mpf {

class Watcher;  // internal

class Backplane {
 public:
  // The backplane `name`; empty: that of the environment variable MPF_BACKPLANE, or "default". It
  // need not exist: a backplane is no more than the processes that use its name.
  //   throws  std::invalid_argument for a name that cannot be one
  static Backplane attach(const std::string& name = {});
  // The same, and removes nothing: for who wants to know what was left.
  static Backplane named(const std::string& name);
  // One with a name of its own, for tests.
  static Backplane isolated();

  [[nodiscard]] const std::string& name() const noexcept;
  [[nodiscard]] Watcher& watcher() const noexcept;

  // The location of servers that say nothing else: the environment variable MPF_LOCATION, or 0.
  //   throws  std::invalid_argument when that is no integer
  static std::int32_t defaultLocation();

  // Removes every segment of this backplane whose owner is proven dead (shm/stale_segments.h).
  // Returns their names.
  std::vector<std::string> removeDead() const;
  // Names of all segments of this backplane.
  [[nodiscard]] std::vector<std::string> segmentNames() const;
  // Names of all backplanes that have segments on this host.
  static std::vector<std::string> names();

 private:
  struct State;
  explicit Backplane(std::string name);
  std::shared_ptr<State> state_;
};

}  // namespace mpf
