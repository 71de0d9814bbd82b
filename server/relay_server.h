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
  //   hops  connections between routers over which it reaches the other server, which its window
  //         shows; 1: a router of that server's host is the peer
  RelayServer(const Backplane& backplane, const std::string& name,
              const ServerOptions& options = {}, std::uint32_t hops = 1);
  using MessageServer::receive;

  // Closes all connections, as the destructor does, which then does not wait for the clients. Call
  // no other function afterwards.
  //   returns  what has to exist for a moment longer, even without the server, so that clients
  //            receive the replies in its pools; nullptr: nothing
  [[nodiscard]] std::shared_ptr<const void> closeAll();
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
  // As receive(). If at least two requests of a client wait, and the next ones are of one type that
  // MessageRun can hold and have no deadline, takes up to `most` of them (2 to MessageRun::kMost)
  // into `run`, perhaps one, and returns an empty handle. The caller ends them, as if it had kept
  // the results of clientOf() and requestId.
  //   client  out: the client of the run; 0: no run was taken, and `run` has any contents
  //   run     out: empty if the client has sent invalid data
  //   throws  as receive()
  [[nodiscard]] Message receive(MessageRun& run, std::uint64_t& client, std::size_t most);
  // Ends the requests of `run`, which receive() has filled, with the fate `refused`.
  void refuse(std::uint64_t client, const MessageRun& run) noexcept;
  // As replyTo(), with several replies that missed none. Stops at the first one for which `isFirst`
  // is wrong, or there is no room. Returns how many were sent; 0 if the client is gone. A time of 0
  // in the words of a reply stands for now, if the server stamps its replies.
  //   isFirst  true: each is the first reply to its request, whose numbers differ; false: each is a
  //            further reply
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
