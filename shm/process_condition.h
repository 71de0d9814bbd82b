// SPDX-License-Identifier: MIT
// ProcessCondition: a condition variable whose copy in the child of a fork may be destroyed, too. A
// std::condition_variable would wait for the threads that waited for it in the parent.
//
// Threads  any.
#pragma once

#include <condition_variable>
#include <memory>

#include "shm/fork_guard.h"

namespace mpf {

class ProcessCondition {
 public:
  ProcessCondition() noexcept { std::construct_at(&condition_); }
  ~ProcessCondition() {
    if (!forkGuard_.isInherited()) std::destroy_at(&condition_);
  }
  ProcessCondition(const ProcessCondition&) = delete;
  ProcessCondition& operator=(const ProcessCondition&) = delete;

  [[nodiscard]] std::condition_variable& get() noexcept { return condition_; }

 private:
  union {
    std::condition_variable condition_;  // NOLINT(readability-identifier-naming): private
  };
  ForkGuard forkGuard_;
};

}  // namespace mpf
