// SPDX-License-Identifier: MIT
#include "python/extension/options.h"

#include <pthread.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace mpf::python {
namespace {

std::atomic<int> forks = 0;

}  // namespace

Deadline deadlineOf(double seconds) {
  if (std::isnan(seconds)) throw std::invalid_argument("timeout: NaN is not a time");
  constexpr double kLongestSeconds = 1e9;
  if (seconds > kLongestSeconds) return Deadline::never();
  if (seconds < 0) seconds = 0;
  return Deadline::after(
      std::chrono::duration_cast<Nanoseconds>(std::chrono::duration<double>(seconds)));
}

WaitMode waitModeOf(const std::string& word) {
  if (word == "spin") return WaitMode::spin;
  if (word == "adaptive") return WaitMode::adaptive;
  if (word == "block") return WaitMode::block;
  throw std::invalid_argument("wait: '" + word + "' is not 'spin', 'adaptive' or 'block'");
}

int forkCount() noexcept { return forks.load(std::memory_order_relaxed); }

void countForks() {
  ::pthread_atfork(nullptr, nullptr, [] { forks.fetch_add(1, std::memory_order_relaxed); });
}

}  // namespace mpf::python
