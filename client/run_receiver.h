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
  // How many replies the next run may have; if fewer than 2, the next reply comes alone.
  [[nodiscard]] virtual std::size_t room() const noexcept = 0;
  // Consecutive replies of a type that MessageRun can have, at least 2.
  //   areFirst  they are first replies to one request each, which they end, or all are further ones
  virtual void onRun(const MessageRun& run, bool areFirst) = 0;

 protected:
  ~RunReceiver() = default;
};

}  // namespace mpf
