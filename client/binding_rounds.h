// SPDX-License-Identifier: MIT
// BindingRounds: the bindings of a dispatcher, and the work that is due for them: a few bindings in
// each step.
//
// Threads  the dispatcher's thread. Callbacks may call each function.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "client/binding.h"
#include "client/dispatcher_parts.h"
#include "client/round.h"

namespace mpf {

class BindingRounds {
 public:
  explicit BindingRounds(DispatcherParts& parts) noexcept : parts_(parts) {}

  // Memory for a binding. Any thread.
  class Place;
  // Does nothing when the binding has left: a client may be destroyed before the command that adds
  // its binding runs.
  //   throws  std::bad_alloc: the binding is added, and the next step handles its timer
  void add(Place&& place);
  // A binding that was added stays alive until dropRemoved().
  void remove(const Binding& binding) noexcept;
  // No callback of a removed binding is in progress.
  void dropRemoved() noexcept;

  // A process has died: resume() disconnects the bindings whose server it was.
  void noteDeath() noexcept { hasRounds_ = hasDeath_ = true; }
  // A server may have appeared: resume() connects the bindings that wait for one.
  void noteName() noexcept { hasRounds_ = hasName_ = true; }
  // Begins and continues these rounds, each after the one before has ended. Returns false when it
  // has found nothing to do.
  //   throws  std::bad_alloc: the next call begins the round
  bool resume() {
    if (!hasRounds_) return false;
    resumeRounds();
    return true;
  }
  // Begins or continues the round of the bindings whose timer is due. Looks at no other binding:
  // thousands of clients may each have a timer that is due at another time.
  void handleDue();

 private:
  struct Member {
    std::shared_ptr<Binding> binding;
    std::int64_t scheduledNs = INT64_MAX;  // its place in schedule_; INT64_MAX: none
  };
  using Members = std::map<const Binding*, Member>;
  [[nodiscard]] std::vector<std::weak_ptr<Binding>> all() const;
  [[nodiscard]] std::vector<std::weak_ptr<Binding>> takeDue(std::int64_t nowNs);
  void schedule(Member& member, std::int64_t dueNs);
  void resumeRounds();
  void resumeDead();
  void resumeWaiting();
  void tryWatchNames() noexcept;

  DispatcherParts& parts_;
  Members bindings_;
  std::set<std::pair<std::int64_t, const Binding*>> schedule_;
  bool isComplete_ = true;  // false: a binding may lack its place in schedule_
  Members removed_;
  bool hasRounds_ = false;  // one of the two below, or a round of them, has not ended
  bool hasDeath_ = false;  // since dead_ began
  bool hasName_ = false;  // since waiting_ began
  Round<Binding> dead_;
  Round<Binding> waiting_;
  Round<Binding> due_;
};

class BindingRounds::Place {
 public:
  //   throws  std::bad_alloc
  explicit Place(std::shared_ptr<Binding> binding);

 private:
  friend BindingRounds;
  Members::node_type member_;
};

}  // namespace mpf
