// SPDX-License-Identifier: MIT
#include <mpf/real_time_priority.h>

#include <sched.h>
#include <time.h>

#include <system_error>
#include <thread>

#include <mpf/clock.h>

namespace mpf {
namespace {

constexpr std::int64_t kWindowNs = 50'000'000;
constexpr std::int64_t kPauseNs = 1'000'000'000;

bool trySchedule(int policy, int priority) noexcept {
  const sched_param parameter{.sched_priority = priority};
  // pid 0: only the calling thread
  return ::sched_setscheduler(0, policy | SCHED_RESET_ON_FORK, &parameter) == 0;
}

std::int64_t usedNs() noexcept {
  timespec used{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return used.tv_sec * 1'000'000'000 + used.tv_nsec;
}

}  // namespace

RealTimePriority::RealTimePriority(int priority) noexcept : priority_(priority) {
  if (priority_ > 0) take();
}

void RealTimePriority::take() noexcept {
  isHeld_ = trySchedule(SCHED_FIFO, priority_);
  if (!isHeld_) priority_ = 0;  // not allowed: do not ask again
  windowBeginNs_ = Clock::nowNs();
  usedBeforeNs_ = usedNs();
}

void RealTimePriority::giveUp() noexcept {
  isHeld_ = !trySchedule(SCHED_OTHER, 0);
  takeAgainNs_ = Clock::nowNs() + kPauseNs;
}

void RealTimePriority::check() noexcept {
  if (priority_ == 0) return;
  const auto now = Clock::nowNs();
  if (!isHeld_) {
    if (now >= takeAgainNs_) take();
    return;
  }
  const auto elapsed = now - windowBeginNs_;
  if (elapsed < kWindowNs) return;
  const auto used = usedNs();
  if (2 * (used - usedBeforeNs_) > elapsed) return giveUp();
  windowBeginNs_ = now;
  usedBeforeNs_ = used;
}

bool RealTimePriority::isAllowed(int priority) try {
  bool isAllowed = false;
  std::thread([&] { isAllowed = RealTimePriority(priority).isHeld(); }).join();
  return isAllowed;
} catch (const std::system_error&) {
  return false;
}

}  // namespace mpf
