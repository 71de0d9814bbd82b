// SPDX-License-Identifier: MIT
// ReplySender: sends the replies and the fates of a server's requests.
//
// Threads  any, also several at once.
// Crash    a reply to a client that has disconnected or died is clientGone.
// Trust    a client cannot make the server wait: a reply that does not fit is refused.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <mpf/message_server.h>

#include "server/connection.h"
#include "server/reply_counts.h"
#include "shm/fork_guard.h"
#include "shm/messages/message_run.h"

namespace mpf {

class ReplySender {
 public:
  //   stamps  give replies without a time stamp the time at which they are sent
  ReplySender(ReplyCounts& counts, bool stamps) noexcept : counts_(counts), stamps_(stamps) {}

  // MessageServer::reply().
  ReplyResult send(Message& message) noexcept;
  // MessageServer::replyMany(), of messages and of values.
  RepliedMany sendMany(std::span<Message> messages) noexcept;
  RepliedMany sendBodies(const Message& request, const Bodies& bodies) noexcept;
  // Sends the values of `run` as the replies to its requests. `generation`: of the connection when
  // they were taken.
  void sendRun(Connection& connection, std::uint32_t generation, const MessageRun& run) noexcept;
  // As RelayServer::replyTo(), with a run.
  std::size_t sendRun(const Route& route, const MessageRun& run, bool isFirst) noexcept;
  // Ends the requests of `run` from `index` on with the fate `refused`.
  void refuse(Connection& connection, std::uint32_t generation, const MessageRun& run,
              std::size_t index) noexcept;
  // Ends a request of `connection` with a fate.
  void sendFate(Connection& connection, RequestMarks request, Fate fate) noexcept;
  // Ends a request whose handle was destroyed without a reply, with the fate `refused`.
  void refuseAbandoned(const Route& route) noexcept;
  // Allocates a body in the memory that is shared with the client of `route`, or on the heap.
  //   throws  std::bad_alloc
  static BodyBytes allocate(const Route& route, std::size_t bytes);

 private:
  // Without data if the client has left, or its pool has no chunk.
  static BodyBytes tryAllocateInPool(const Route& route, std::size_t bytes) noexcept;
  RepliedMany sendRun(std::span<Message> messages) noexcept;
  RepliedMany sendRun(const Message& request, const Bodies& bodies) noexcept;
  std::size_t sendRunLocked(Connection& connection, const MessageRun& run, std::size_t count,
                            bool isFirst) noexcept;
  void sendFullSlotsLocked(Connection& connection, const Message& request, const Bodies& bodies,
                           RepliedMany& sent) noexcept;
  ReplyResult sendOneLocked(Connection& connection, Message& message) noexcept;
  // The caller counts what was sent.
  ReplyResult sendLocked(Connection& connection, Message& message) noexcept;
  ReplyResult noteRefused(LinkSend result) noexcept;

  ReplyCounts& counts_;
  const bool stamps_;
};

}  // namespace mpf
