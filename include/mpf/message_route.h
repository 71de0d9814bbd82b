// SPDX-License-Identifier: MIT
// Route: where the reply to a message goes. RouteKeeper: is notified when a request will get no
// reply.
//
// Programs need neither. Transports, which move messages between processes, use them through
// <mpf/message.h>.
//
// Threads  a Route is plain data. RouteKeeper says which thread calls it.
// Throws   nothing.
// Trust    `link` and `keeper` never come from a peer; the rest may have any value.
#pragma once

#include <cstdint>

#include <mpf/detail/cpp20.h>

namespace mpf {

struct Route;
// Receives a call when the handle of a request is destroyed without a reply. It must outlive every
// handle whose route names it. MessageServer has one, which ends the request as `refused`; programs
// need none of their own.
class RouteKeeper {
 public:
  // Runs on the thread that destroys the handle, so calls may run at the same time. `route` is
  // valid during the call.
  virtual void abandoned(const Route& route) noexcept = 0;

 protected:
  ~RouteKeeper() = default;
};

// A bit of Route::flags, in messages that a client received: the message ended its request. Further
// replies, and messages that belong to no request, do not have it.
inline constexpr std::uint32_t kEndsRequest = 1;

// Where a reply to this message goes. Transports write and read it; servers do not interpret it,
// and MessageServer::allocReplyMessage() copies it into a reply. It is valid in this process only,
// and is not sent to the peer.
struct Route {
  std::uint64_t link{};  // the connection of the client; 0 in messages that a client received
  std::uint32_t requestId{};  // the client's number of the request; 0: of no request
  // at a client: kEndsRequest, and Message::getMissed(); at a server: for the transport only
  std::uint32_t flags{};
  RouteKeeper* keeper = nullptr;  // of requests that have had no reply; not owned
};

}  // namespace mpf
