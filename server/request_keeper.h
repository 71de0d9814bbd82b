// SPDX-License-Identifier: MIT
// RequestKeeper: refuses the requests of a server whose handles are destroyed without a reply.
//
// Handles of requests may outlive their server, so keepers are never freed: they cost a few bytes
// for each server that the process creates.
//
// Threads  any.
#pragma once

#include <mpf/message.h>

namespace mpf {

class ReplySender;

// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): never destroyed
class RequestKeeper final : public RouteKeeper {
 public:
  static RequestKeeper& make(ReplySender& replies);
  // The server ends: nothing is sent from now on.
  void leave() noexcept;
  void abandoned(const Route& route) noexcept override;

 private:
  ReplySender* replies_ = nullptr;
};

}  // namespace mpf
