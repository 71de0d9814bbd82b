// SPDX-License-Identifier: MIT
// DispatcherParts: what a dispatcher shares with its bindings.
//
// Threads  as each part says; CallbackErrors: the dispatcher's thread.
#pragma once

#include <utility>

#include "client/callback_errors.h"
#include "client/command_queue.h"
#include "client/dispatcher_timer.h"
#include "client/name_watch.h"
#include "client/runner_lock.h"
#include "shm/endpoint.h"

namespace mpf {

struct DispatcherParts {
  // The parameters of Endpoint.
  template <class... Args>
  explicit DispatcherParts(Args&&... args) : endpoint(std::forward<Args>(args)...) {}

  Endpoint endpoint;
  RunnerLock lock;
  CommandQueue commands{lock, [this] { endpoint.interrupt(); }};
  DispatcherTimer timer{endpoint};
  NameWatch names{endpoint};
  CallbackErrors errors;
};

}  // namespace mpf
