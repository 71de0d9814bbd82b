// SPDX-License-Identifier: MIT
// RelayClient: a client that sends on behalf of other clients. Routers use it.
//
// Threads  the thread that runs the dispatcher.
#pragma once

#include <mpf/message_client.h>

#include "client/run_receiver.h"

namespace mpf {

class RelayClient : public MessageClient {
 public:
  using MessageClient::MessageClient;

  // As send(), with a number that the caller chooses, not 0. Returns tooManyOutstanding also when
  // another request occupies the place of that number in the table of requests.
  [[nodiscard]] SendResult sendAs(std::uint32_t requestId, Message&& message,
                                  Deadline takeBefore) noexcept;
  // The same for a run of requests without deadlines. Returns how many were sent; the others may be
  // sent one by one, which says why they are refused.
  [[nodiscard]] std::size_t sendAs(const MessageRun& run) noexcept;
  // `receiver`, which outlives this object, gets consecutive Int32 or OutOfBand replies together.
  // Replies that come alone and all other messages go to the callback of the constructor. From now
  // on, a further reply before the first one ends the link as a protocol error. Call it before
  // bind(), once.
  void setRunReceiver(RunReceiver& receiver);
  // Whether the last attempt to connect failed because this process or its host lacks descriptors,
  // memory or threads. The client tries again.
  [[nodiscard]] bool lacksResources() const noexcept;
  // Whether a message that the callback received ended its request.
  [[nodiscard]] static bool endsRequest(const Message& message) noexcept {
    return (message.route().flags & kEndsRequest) != 0;
  }
  // Stops the delivery of messages from the server until resume() or the end of the connection. The
  // messages wait in the link; when it is full, the server's replies fail with queueFull.
  void pause();
  void resume();
  // Allocates memory for the body of a request, as alloc() does; the caller owns it: see BodyBytes.
  //   throws  std::bad_alloc
  [[nodiscard]] BodyBytes allocateBody(std::size_t bytes) { return allocate(bytes); }
};

}  // namespace mpf
