// SPDX-License-Identifier: MIT
// DispatcherParts: what a dispatcher shares with its bindings.
//
// Threads  as each part says; LinkOwners and CallbackErrors: the dispatcher's thread.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "client/callback_errors.h"
#include "client/command_queue.h"
#include "client/dispatcher_timer.h"
#include "client/name_watch.h"
#include "client/runner_lock.h"
#include "shm/endpoint.h"

namespace mpf {

class Binding;

// The binding of each link of the endpoint.
class LinkOwners {
 public:
  //   binding   nullptr when the link has ended
  void set(std::uint32_t index, Binding* binding) {
    if (index >= bindings_.size()) bindings_.resize(index + 1);
    bindings_[index] = binding;
  }
  [[nodiscard]] Binding* find(std::uint32_t index) const noexcept {
    return index < bindings_.size() ? bindings_[index] : nullptr;
  }

 private:
  std::vector<Binding*> bindings_;  // by the index of the link
};

struct DispatcherParts {
  // The parameters of Endpoint.
  template <class... Args>
  explicit DispatcherParts(Args&&... args) : endpoint(std::forward<Args>(args)...) {}

  Endpoint endpoint;
  RunnerLock lock;
  CommandQueue commands{lock, [this] { endpoint.interrupt(); }};
  DispatcherTimer timer{endpoint};
  NameWatch names{endpoint};
  LinkOwners linkOwners;
  CallbackErrors errors;
};

}  // namespace mpf
