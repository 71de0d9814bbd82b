// SPDX-License-Identifier: MIT
#include "client/binding_rounds.h"

#include <algorithm>

namespace mpf {

// A client may be destroyed before the command that adds its binding runs.
void BindingRounds::add(const std::shared_ptr<Binding>& binding) {
  if (!binding->hasLeft()) bindings_.insert(binding);
}

void BindingRounds::remove(const std::shared_ptr<Binding>& binding) {
  bindings_.erase(binding);
  removed_.push_back(binding);
  // It may have been the last binding that waited for a server: then the watch of names can end.
  if (parts_.names.isRunning()) parts_.names.noteChange();
}

void BindingRounds::resumeRounds() {
  dead_.resume([](Binding& binding) {
    if (!binding.hasDeadPeer()) return false;
    binding.disconnect("the process of the server exited", Binding::Ending::serverGone);
    return true;
  });
  if (waiting_.isOver()) return;
  waiting_.resume([](Binding& binding) {
    if (!binding.isWaiting()) return false;
    binding.tryConnect();
    return true;
  });
  if (!waiting_.isOver()) return;
  if (std::ranges::any_of(bindings_, [](const auto& binding) { return binding->isWaiting(); })) {
    parts_.names.start();
  } else {
    parts_.names.stop();
  }
}

void BindingRounds::handleDue() {
  auto& timer = parts_.timer;
  if (due_.isOver()) {
    timer.reset();
    due_.begin(bindings_);
  }
  const auto nowNs = Clock::nowNs();
  try {
    due_.resume([nowNs](Binding& binding) {
      if (binding.dueNs() > nowNs) return false;
      binding.onTime(nowNs);
      return true;
    });
  } catch (...) {
    timer.wakeAt(nowNs);  // the next step handles the other bindings, and the rest of this one
    throw;
  }
  if (!due_.isOver()) return timer.wakeAt(nowNs);  // the next step continues the round
  for (const auto& binding : bindings_) timer.wakeAt(binding->dueNs());
}

}  // namespace mpf
