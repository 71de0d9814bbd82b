// SPDX-License-Identifier: MIT
// RelayServer: a server that answers on behalf of another server. Routers use it.
//
//   client   a number that clientOf() has returned
//
// Threads  as MessageServer.
#pragma once

#include <mpf/message_server.h>

#include "shm/messages/message_run.h"

namespace mpf {

class RelayServer : public MessageServer {
 public:
  using MessageServer::MessageServer;
  using MessageServer::receive;

  // Sets a callback for clients that connect (isConnected true) and disconnect or die (false).
  // receive() calls it. Set it before the first receive(). When it throws, receive() finishes its
  // work on the connections and then throws the same exception.
  void onClient(std::function<void(std::uint64_t client, bool isConnected)> callback);
  // The deadline that the client gave to the request that receive() returned last.
  [[nodiscard]] Deadline takeBefore() const noexcept;
  // As reply(), to a request whose handle no longer exists. The caller has kept the results of
  // clientOf(request) and request.route().requestId. The client gets the getMissed() of `message`,
  // a received message, unless it holds ServerOptions::maxBorrowed such messages or there is no
  // memory for a copy. A message that is not sent keeps the number.
  ReplyResult replyTo(std::uint64_t client, std::uint32_t requestId, Message&& message);
  // As long as `isPolled` is true, the caller calls receive() all the time, and the descriptor does
  // not become readable for requests. After a change to false, call receive() until it returns an
  // empty handle.
  void setPolled(bool isPolled) noexcept;
  // As receive(). If the next requests of a client have no deadline, are of the same type, and this
  // type may be in a run, takes up to `most` of them into `run`, sets `client`, which was 0, and
  // returns an empty handle. The caller ends these requests, as if it had kept the results of
  // clientOf() and requestId; `run` is empty if the client has sent invalid data.
  //   throws  as receive()
  [[nodiscard]] Message receive(MessageRun& run, std::uint64_t& client, std::size_t most);
  // Ends requests of a run that was received as `refused`.
  void refuse(std::uint64_t client, const MessageRun& run) noexcept;
  // As replyTo(), with several replies: all are first replies to one request each, or none is.
  // Stops at one of which this is not true, or for which there is no room. Returns how many were
  // sent.
  [[nodiscard]] std::size_t replyTo(std::uint64_t client, const MessageRun& run,
                                    bool isFirst) noexcept;
  // Whether that request still has no reply.
  [[nodiscard]] bool isUnanswered(std::uint64_t client, std::uint32_t requestId) const noexcept;
  // The requests of a client that were received and still have no reply.
  [[nodiscard]] std::vector<std::uint32_t> unanswered(std::uint64_t client) const;
  // Allocates memory for the body of a reply to a client; the caller owns it: see BodyBytes.
  //   throws  std::bad_alloc
  [[nodiscard]] BodyBytes allocateBody(std::uint64_t client, std::size_t bytes);
};

}  // namespace mpf
