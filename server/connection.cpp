// SPDX-License-Identifier: MIT
#include "server/connection.h"

#include <pthread.h>

#include <bit>
#include <mutex>
#include <new>
#include <utility>

#include <mpf/clock.h>

namespace mpf {
namespace {

std::mutex freeMutex;
Connection* freeConnections = nullptr;  // under freeMutex

// A fork waits until no thread holds the mutex: the child could never lock it again.
[[maybe_unused]] const int kForkHandlers = ::pthread_atfork(
    [] { freeMutex.lock(); }, [] { freeMutex.unlock(); }, [] { freeMutex.unlock(); });

Connection* tryTakeFree() noexcept {
  const std::lock_guard guard(freeMutex);
  if (freeConnections == nullptr) return nullptr;
  return std::exchange(freeConnections, freeConnections->nextFree);
}

}  // namespace

Connection::Pointer Connection::take() {
  Pointer connection(tryTakeFree());
  if (!connection) return Pointer(new Connection);
  if (connection->forkGuard.isInherited()) {
    // Another thread of the parent might have held the lock at the fork.
    connection->lock = std::make_shared<BiasedLock>();
    connection->forkGuard = {};
  }
  return connection;
}

void Connection::beginGeneration() noexcept {
  const BiasedLock::Guard guard(*lock);
  ++generation;
}

// Gives requests that differ in more bits different places, up to the size at which the client must
// use different ones. The client may have received a reply that another thread is still sending
// under the lock: then the place becomes free.
bool Connection::tryMakePlace(std::uint32_t requestId) noexcept try {
  const auto size = std::bit_ceil(channel->link().header().maxOutstanding);
  std::vector<std::atomic<std::uint64_t>> larger(unanswered.size() == size ? 0 : size);
  const BiasedLock::Guard guard(*lock);
  if (larger.empty()) return placeOf(requestId).load(std::memory_order_relaxed) == 0;
  for (const auto& place : unanswered) {
    const auto request = place.load(std::memory_order_relaxed);
    if (request != 0)
      larger[detail::firstOf(request) % size].store(request, std::memory_order_relaxed);
  }
  unanswered = std::move(larger);
  unansweredMask = size - 1;
  return placeOf(requestId).load(std::memory_order_relaxed) == 0;
} catch (const std::bad_alloc&) {
  return false;
}

void Connection::noteServiceTime(ReplyCounts& counts) noexcept {
  counts.service(Clock::nowNs() - timedFromNs);
  timedId = 0;
}

void Connection::GiveBack::operator()(Connection* connection) const noexcept {
  if (connection->forkGuard.isInherited()) {
    // Handles that were copied, too, may refer to it, so it is kept, and not used again. No lock:
    // another thread might have held it at the fork.
    static std::atomic<Connection*> inherited{nullptr};
    connection->nextFree = inherited.exchange(connection, std::memory_order_relaxed);
    return;
  }
  const std::lock_guard guard(freeMutex);
  connection->nextFree = std::exchange(freeConnections, connection);
}

}  // namespace mpf
