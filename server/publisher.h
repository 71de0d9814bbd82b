// SPDX-License-Identifier: MIT
// Publisher: sends one message of a server to many of its clients, without a copy for each.
//
//   allocate ─► FanOutChunk ◄─ holder ─ message of the program
//   publish  ─► lends the chunk to the link of each request ─► ChunkRef in its reply ring
//
// Threads  any.
// Crash    Connections ends the loans of a client that has died.
// Trust    a client that returns nothing gets no more than maxBorrowed messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <mpf/message.h>
#include <mpf/message_server.h>

#include "server/connection.h"
#include "server/reply_counts.h"
#include "shm/fan_out_pool.h"
#include "shm/fork_guard.h"
#include "shm/window.h"

namespace mpf {

// The lender of the bodies that a program builds. Such a body may outlive the server. The copy in
// the child of a fork does nothing: another thread of the parent might have held the mutex.
class FanOutBodies final : public BodyLender, public std::enable_shared_from_this<FanOutBodies> {
 public:
  //   throws  std::bad_alloc
  BodyBytes lend(std::shared_ptr<FanOutChunk> chunk, std::size_t bytes);
  // The chunk of a body that was lent; nullptr in the child of a fork.
  [[nodiscard]] std::shared_ptr<FanOutChunk> tryFind(const std::byte* data) const noexcept;
  void takeBack(std::byte* data, std::size_t capacity) noexcept override;

 private:
  ForkGuard forkGuard_;
  mutable std::mutex mutex_;  // guards the members below
  std::vector<std::shared_ptr<FanOutChunk>> lent_;
  std::shared_ptr<FanOutBodies> self_;  // set while lent_ is not empty
};

class Publisher {
 public:
  //   throws  std::invalid_argument when options.maxBorrowed is out of range
  Publisher(const std::string& backplane, OwnWindow& window, ReplyCounts& counts,
            const ServerOptions& options);

  // A body in the fan-out pool, or on the heap if the pool has no chunk for it.
  //   throws  std::bad_alloc
  BodyBytes allocate(std::size_t bytes);
  // MessageServer::publish().
  std::size_t publish(const Message& message, std::span<const Message> requests,
                      std::span<ReplyResult> results) noexcept;
  // Sends one message on its route, and tells its client how many messages of the request were
  // dropped before it.
  ReplyResult relay(const Message& message, std::uint32_t missed) noexcept;
  // Its destructor removes the names of the messages, also of those that clients have not received.
  [[nodiscard]] std::shared_ptr<const FanOutPool> pool() const noexcept { return pool_; }

 private:
  std::shared_ptr<FanOutChunk> tryAlloc(std::size_t bytes) noexcept;
  std::shared_ptr<FanOutChunk> tryCopy(std::span<const std::byte> body) noexcept;
  // The number of dropped messages that the client is told; nullopt: the link counts them.
  using Missed = std::optional<std::uint32_t>;
  ReplyResult send(const Message& message, const Message& request,
                   const std::shared_ptr<FanOutChunk>& chunk, Missed missed) noexcept;
  ReplyResult sendLocked(Connection& connection, const Message& message, const Message& request,
                         const std::shared_ptr<FanOutChunk>& chunk, Missed missed) noexcept;
  void noteBorrower(const std::shared_ptr<MessageLink>& channel) noexcept;
  void collectReturned() noexcept;

  ForkGuard forkGuard_;
  ReplyCounts& counts_;
  std::uint64_t serverWindow_;
  std::uint32_t maxBorrowed_;
  bool stamps_;
  std::shared_ptr<FanOutPool> pool_;
  std::shared_ptr<FanOutBodies> bodies_ = std::make_shared<FanOutBodies>();
  std::mutex mutex_;  // guards the members below
  std::vector<std::weak_ptr<MessageLink>> borrowers_;  // links that have had a loan
};

}  // namespace mpf
