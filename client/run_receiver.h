// SPDX-License-Identifier: MIT
// RunReceiver: gets replies together, for a client that relays them.
//
// Threads  the dispatcher's thread.
#pragma once

#include <cstddef>

#include "shm/messages/message_run.h"

namespace mpf {

class RunReceiver {
 public:
  // How many replies the next run may have, at most MessageRun::kMost of which are taken; if fewer
  // than 2, the next reply comes alone. Called before each run.
  [[nodiscard]] virtual std::size_t room() const noexcept = 0;
  // Consecutive replies of a type that MessageRun can hold, at least 2, with their time stamps.
  // They are valid until it returns. It may throw, as the callback of the client.
  //   isFirst  true: each is the first reply to its request, which it has ended; false: each is a
  //            further reply, perhaps to different requests
  virtual void onRun(const MessageRun& run, bool isFirst) = 0;

 protected:
  ~RunReceiver() = default;
};

}  // namespace mpf
