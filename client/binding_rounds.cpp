// SPDX-License-Identifier: MIT
#include "client/binding_rounds.h"

#include <algorithm>
#include <exception>

namespace mpf {

BindingRounds::Place::Place(std::shared_ptr<Binding> binding) {
  Members members;
  const auto* const key = binding.get();
  member_ = members.extract(members.try_emplace(key, Member{std::move(binding)}).first);
}

void BindingRounds::add(Place&& place) {
  if (place.member_.mapped().binding->hasLeft()) return;
  auto& member = bindings_.insert(std::move(place.member_)).position->second;
  const bool wasComplete = std::exchange(isComplete_, false);
  const auto dueNs = member.binding->takeReportedDueNs();
  schedule(member, dueNs);
  // The dispatcher may have seen the time before it knew the binding.
  parts_.timer.wakeAt(dueNs);
  isComplete_ = wasComplete;
}

// Moves the bindings out of removed_ first: destroying a callback may destroy a client, which calls
// remove().
void BindingRounds::dropRemoved() noexcept { const auto dropped = std::exchange(removed_, {}); }

void BindingRounds::remove(const Binding& binding) noexcept {
  if (const auto found = bindings_.find(&binding); found != bindings_.end()) {
    schedule(found->second, INT64_MAX);
    removed_.insert(bindings_.extract(found));
  }
  // It may have been the last binding that waited for a server: then the watch of names can end.
  if (parts_.names.isRunning()) parts_.names.noteChange();
}

std::vector<std::weak_ptr<Binding>> BindingRounds::all() const {
  std::vector<std::weak_ptr<Binding>> all;
  all.reserve(bindings_.size());
  for (const auto& [key, member] : bindings_) all.push_back(member.binding);
  return all;
}

void BindingRounds::schedule(Member& member, std::int64_t dueNs) {
  if (dueNs == member.scheduledNs) return;
  if (member.scheduledNs != INT64_MAX) schedule_.erase({member.scheduledNs, member.binding.get()});
  member.scheduledNs = INT64_MAX;
  if (dueNs == INT64_MAX) return;
  schedule_.emplace(dueNs, member.binding.get());
  member.scheduledNs = dueNs;
}

// Removes the bindings that are due from the schedule, and returns them. When it throws for lack of
// memory, it has forgotten some; the next call looks at every binding.
std::vector<std::weak_ptr<Binding>> BindingRounds::takeDue(std::int64_t nowNs) {
  const auto lowered = parts_.timer.takeLowered();
  if (std::exchange(isComplete_, false) && lowered) {
    for (const auto* key : *lowered) {
      const auto found = bindings_.find(key);
      if (found != bindings_.end())
        schedule(found->second, found->second.binding->takeReportedDueNs());
    }
  } else {
    for (auto& [key, member] : bindings_) schedule(member, member.binding->takeReportedDueNs());
  }
  std::vector<std::weak_ptr<Binding>> due;
  while (!schedule_.empty() && schedule_.begin()->first <= nowNs) {
    auto& member = bindings_.find(schedule_.begin()->second)->second;
    due.push_back(member.binding);
    schedule(member, INT64_MAX);
  }
  isComplete_ = true;
  return due;
}

void BindingRounds::resumeRounds() {
  resumeDead();
  resumeWaiting();
  hasRounds_ = hasDeath_ || hasName_ || !dead_.isOver() || !waiting_.isOver();
}

void BindingRounds::resumeDead() {
  if (dead_.isOver() && hasDeath_) {
    dead_.begin(all());
    hasDeath_ = false;
  }
  dead_.resume([](Binding& binding) {
    if (!binding.hasDeadPeer()) return false;
    binding.disconnect("the process of the server exited", Binding::Ending::serverGone);
    return true;
  });
}

void BindingRounds::resumeWaiting() {
  if (waiting_.isOver()) {
    if (!hasName_) return;
    waiting_.begin(all());
    hasName_ = false;
  }
  waiting_.resume([](Binding& binding) {
    if (!binding.isWaiting()) return false;
    binding.tryConnect();
    return true;
  });
  if (!waiting_.isOver()) return;
  if (std::ranges::any_of(bindings_,
                          [](const auto& each) { return each.second.binding->isWaiting(); })) {
    tryWatchNames();
  } else {
    parts_.names.stop();
  }
}

// Each attempt to connect starts the watch, too: if that failed, notConnectedBecause() returns the
// reason, and the timer of the binding repeats the attempt.
void BindingRounds::tryWatchNames() noexcept try {
  parts_.names.start();
  // NOLINTNEXTLINE(bugprone-empty-catch): see above
} catch (const std::exception&) {
}

void BindingRounds::handleDue() {
  auto& timer = parts_.timer;
  const auto nowNs = Clock::nowNs();
  try {
    if (due_.isOver()) {
      timer.reset();
      due_.begin(takeDue(nowNs));
    }
    due_.resume([nowNs](Binding& binding) {
      if (binding.dueNs() > nowNs) return false;  // a callback has run the dispatcher
      binding.onTime(nowNs);
      return true;
    });
  } catch (...) {
    timer.wakeAt(nowNs);  // the next step handles the other bindings, and the rest of this one
    throw;
  }
  if (!due_.isOver()) return timer.wakeAt(nowNs);  // the next step continues the round
  if (!schedule_.empty()) timer.wakeAt(schedule_.begin()->first);
}

}  // namespace mpf
