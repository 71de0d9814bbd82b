// SPDX-License-Identifier: MIT
// BindingRounds: the bindings of a dispatcher, and the work that is due for them: a few bindings in
// each step.
//
// Threads  the dispatcher's thread. Callbacks may call each function.
#pragma once

#include <memory>
#include <set>
#include <vector>

#include "client/binding.h"
#include "client/dispatcher_parts.h"
#include "client/round.h"

namespace mpf {

class BindingRounds {
 public:
  explicit BindingRounds(DispatcherParts& parts) noexcept : parts_(parts) {}

  void add(const std::shared_ptr<Binding>& binding);
  // The binding stays alive until dropRemoved().
  void remove(const std::shared_ptr<Binding>& binding);
  // No callback of a removed binding is in progress.
  void dropRemoved() noexcept { removed_.clear(); }

  // A process has died: disconnects the bindings whose server it was.
  void beginDead() { dead_.begin(bindings_); }
  // A server may have appeared: connects the bindings that wait for one.
  void beginWaiting() { waiting_.begin(bindings_); }
  // Continues these rounds. Returns true when one was in progress.
  bool resume() {
    if (dead_.isOver() && waiting_.isOver()) return false;
    resumeRounds();
    return true;
  }
  // Begins or continues the round of the bindings whose timer is due.
  void handleDue();

 private:
  void resumeRounds();

  DispatcherParts& parts_;
  std::set<std::shared_ptr<Binding>> bindings_;
  std::vector<std::shared_ptr<Binding>> removed_;
  Round<Binding> dead_;
  Round<Binding> waiting_;
  Round<Binding> due_;
};

}  // namespace mpf
