// SPDX-License-Identifier: MIT
#include "drivers/gpib/bus_turns.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

namespace mpf {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;  // CLOCK_MONOTONIC, as Deadline

}  // namespace

GpibResult BusTurns::take(GpibUser user, Deadline deadline) {
  std::unique_lock lock(mutex_);
  Waiter self{.user = user};
  const auto place = waiters_.insert(waiters_.end(), &self);
  handOver();
  while (!self.hasTurn) {
    if (deadline.hasPassed()) {
      waiters_.erase(place);
      return refusal(user);
    }
    const auto until = isLeased() ? std::min(deadline, lease_->until) : deadline;
    if (until.isNever()) {
      self.changed.wait(lock);
    } else {
      self.changed.wait_until(lock, SteadyTime(Nanoseconds(until.ns())));
    }
    handOver();  // a lease may have ended
  }
  return {};
}

void BusTurns::give() noexcept {
  const std::lock_guard lock(mutex_);
  isBusy_ = false;
  handOver();
}

bool BusTurns::mayPass(GpibUser user) const noexcept {
  return !isLeased() || user == lease_->user || user == kBusItself;
}

// Gives the bus to the first waiter that may have it.
void BusTurns::handOver() noexcept {
  if (isBusy_) return;
  const auto next =
      std::ranges::find_if(waiters_, [&](const Waiter* waiter) { return mayPass(waiter->user); });
  if (next == waiters_.end()) return;
  isBusy_ = true;
  (*next)->hasTurn = true;
  (*next)->changed.notify_one();
  waiters_.erase(next);
}

GpibResult BusTurns::refusal(GpibUser user) const {
  if (!mayPass(user)) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(lease_->until.left());
    return {GpibStatus::leased,
            fmt::format("the operation has not begun: the bus is leased by \"{}\" for {} ms more; "
                        "repeat it later",
                        lease_->name, left.count())};
  }
  return {GpibStatus::timeout,
          "the operation has not begun: the bus was busy with other operations until its deadline; "
          "use a longer timeout"};
}

GpibResult BusTurns::lease(GpibUser user, std::string name, std::chrono::milliseconds limit,
                           Deadline deadline) {
  if (user == 0 || user == kBusItself)
    return {GpibStatus::failure, "the bus cannot be leased to user 0: use the id of a user"};
  if (auto taken = take(user, deadline); !taken.ok()) return taken;
  const std::lock_guard lock(mutex_);
  const auto sinceNs = isLeased() ? lease_->sinceNs : Clock::nowNs();
  lease_ = {user, std::move(name), sinceNs, Deadline::after(limit)};
  for (auto* const waiter : waiters_) waiter->changed.notify_one();  // they wait for its end
  isBusy_ = false;
  handOver();
  return {};
}

void BusTurns::release(GpibUser user) noexcept {
  const std::lock_guard lock(mutex_);
  if (!lease_ || lease_->user != user) return;
  lease_.reset();
  handOver();
}

std::optional<GpibLeaseHolder> BusTurns::holder() const {
  const std::lock_guard lock(mutex_);
  return isLeased() ? lease_ : std::nullopt;
}

std::size_t BusTurns::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiters_.size();
}

}  // namespace mpf
