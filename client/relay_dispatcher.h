// SPDX-License-Identifier: MIT
// RelayDispatcher: a dispatcher that its owner may poll. Routers use it.
//
// Threads  as Dispatcher.
#pragma once

#include <mpf/dispatcher.h>

namespace mpf {

class RelayDispatcher : public Dispatcher {
 public:
  using Dispatcher::Dispatcher;

  // As long as `isPolled` is true, the caller calls runPending() all the time, and the descriptor
  // does not become readable for messages. After a change to false, call runPending() until it
  // returns true.
  void setPolled(bool isPolled) noexcept;
  // As runPending(), but after false the descriptor need not be readable: the caller calls again
  // without waiting for it.
  //   throws  as runPending(); then the descriptor is readable
  bool runSome(int batches);
};

}  // namespace mpf
