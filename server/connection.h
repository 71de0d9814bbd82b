// SPDX-License-Identifier: MIT
// Connection: the server's end of one client's connection. Connection objects are reused;
// `generation` distinguishes the clients that have used the same object. Clients number their
// requests with 32 bits, so it also distinguishes requests that have the same id.
//
// Threads  the server's thread changes a connection; any thread may read and reply under `lock`.
//          Any thread may call take() and GiveBack.
// Lifetime a handle of a request refers to its connection by address and may outlive its server:
//          connections are never freed, and the servers of a process share them. There are as many
//          connections as the process has had clients at one time.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <mpf/detail/copy_words.h>

#include "server/reply_counts.h"
#include "shm/fork_guard.h"
#include "shm/messages/message_link.h"

namespace mpf {

struct Connection final : LinkUser {
  struct GiveBack {
    void operator()(Connection* connection) const noexcept;
  };
  using Pointer = std::unique_ptr<Connection, GiveBack>;
  // Returns a free connection; creates one when there is no free one.
  static Pointer take();

  // The connection of a route with a link.
  [[nodiscard]] static Connection& of(const Route& route) noexcept {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): only servers interpret the link of a route
    return *reinterpret_cast<Connection*>(route.link);
  }
  // The route of a request of the present client; 0: of no request.
  [[nodiscard]] Route routeOf(std::uint32_t requestId, RouteKeeper* keeper) noexcept {
    return {reinterpret_cast<std::uint64_t>(this), requestId, generation, keeper};
  }
  // The connection of any route, for callers that lock it. Returns nullptr if the route has no
  // link, and in the child of a fork: there, `lock` may be held for ever.
  [[nodiscard]] static Connection* tryOf(const Route& route) noexcept {
    if (route.link == 0) return nullptr;
    auto& connection = of(route);
    return connection.forkGuard.isInherited() ? nullptr : &connection;
  }
  // Under lock: whether the client of this route is still connected.
  [[nodiscard]] bool isOpenFor(const Route& route) const noexcept {
    return channel && route.flags - clientGeneration <= generation - clientGeneration;
  }
  // The number that MessageServer::clientOf() returns for the present client.
  [[nodiscard]] std::uint64_t client() const noexcept {
    return std::uint64_t{index + 1} << 32 | clientGeneration;
  }
  // The place of a request in `unanswered`; it contains the request until the first reply.
  [[nodiscard]] std::atomic<std::uint64_t>& placeOf(std::uint32_t requestId) noexcept {
    return unanswered[requestId & unansweredMask];
  }
  // Under lock, if a client is connected: the route to it for a caller that knows the id only. If
  // two requests had this id, it is that of the one without a reply.
  [[nodiscard]] Route routeTo(std::uint32_t requestId) noexcept {
    auto route = routeOf(requestId, nullptr);
    if (isUnanswered(requestId))
      route.flags = detail::secondOf(placeOf(requestId).load(std::memory_order_relaxed));
    return route;
  }
  // Notes that a request was received. Returns false if its id is invalid: another one has the same
  // place. Called by the server's thread, without the lock.
  [[nodiscard]] bool tryNoteRequest(std::uint32_t requestId) noexcept {
    if (requestId == 0) return false;
    if (std::exchange(lastId, requestId) > requestId + kHalfOfIds) [[unlikely]]
      beginGeneration();
    auto* place = &placeOf(requestId);
    if (place->load(std::memory_order_relaxed) != 0) {
      if (!tryMakePlace(requestId)) return false;
      place = &placeOf(requestId);
    }
    place->store(detail::joined(requestId, generation), std::memory_order_relaxed);
    return true;
  }
  // Whether the request of this route, or any request with this id, has had no reply.
  // Inline, because it is on the path of each message.
  [[nodiscard, gnu::always_inline]] bool isUnanswered(const Route& route) noexcept {
    const auto request = detail::joined(route.requestId, route.flags);
    return route.requestId != 0 &&
           placeOf(route.requestId).load(std::memory_order_relaxed) == request;
  }
  [[nodiscard]] bool isUnanswered(std::uint32_t requestId) noexcept {
    return requestId != 0 &&
           detail::firstOf(placeOf(requestId).load(std::memory_order_relaxed)) == requestId;
  }
  // Under lock: notes that the first reply to a request was sent.
  [[gnu::always_inline]] void noteFirstReply(std::uint32_t requestId,
                                             ReplyCounts& counts) noexcept {
    placeOf(requestId).store(0, std::memory_order_relaxed);
    if (requestId == timedId) noteServiceTime(counts);
  }

  ForkGuard forkGuard;
  std::shared_ptr<BiasedLock> lock = std::make_shared<BiasedLock>();
  std::shared_ptr<MessageLink> channel;  // under lock; empty: free
  std::uint32_t index = 0;  // of the link in the server's endpoint
  std::uint32_t generation = 0;  // of the requests that are received now; under lock
  std::uint32_t clientGeneration = 0;  // of the first requests of the client; under lock
  std::uint32_t lastId = 0;  // of the request that was received last; server's thread
  // Received requests without a reply, id and generation, by the low bits of the id; the size is a
  // power of two. It begins small, because most clients have few requests at a time. The server's
  // thread makes it larger under lock.
  std::vector<std::atomic<std::uint64_t>> unanswered;
  std::uint32_t unansweredMask = 0;
  std::uint32_t timedId = 0;  // the request whose service time is measured, under lock
  std::int64_t timedFromNs = 0;
  Connection* nextFree = nullptr;

 private:
  // If the next id is less than the last one by more than this, the client has used all ids and
  // begins again.
  static constexpr std::uint64_t kHalfOfIds = std::uint64_t{1} << 31;
  void beginGeneration() noexcept;
  void noteServiceTime(ReplyCounts& counts) noexcept;
  [[nodiscard]] bool tryMakePlace(std::uint32_t requestId) noexcept;
};

}  // namespace mpf
