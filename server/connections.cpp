// SPDX-License-Identifier: MIT
#include "server/connections.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <new>
#include <thread>
#include <utility>

#include "base/step.h"
#include "shm/histogram.h"
#include "shm/stale_segments.h"

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kDrainTimeout{100};
constexpr std::chrono::microseconds kDrainPoll{500};

// Whether the client holds messages of the fan-out pool, or has not received them.
bool isBorrowing(Connection& connection) noexcept {
  const BiasedLock::Guard lock(*connection.lock);
  auto& link = connection.channel->link();
  link.collectReturned();
  return link.borrowedFanOut() != 0;
}

void keep(const std::shared_ptr<MessageLink>& channel, Connections::Channels& channels) noexcept
    try {
  channels.push_back(channel);
  // NOLINTNEXTLINE(bugprone-empty-catch): the server does not wait for this client
} catch (const std::bad_alloc&) {
}

}  // namespace

void Connections::reportClient(std::uint64_t client, bool isConnected) noexcept try {
  if (onClient_) onClient_(client, isConnected);
} catch (...) {
  try {
    thrown_.push_back(std::current_exception());
    endpoint_.interrupt();  // the next wait() returns at once
    // NOLINTNEXTLINE(bugprone-empty-catch): the exception is lost
  } catch (const std::bad_alloc&) {
  }
}

void Connections::throwNext() {
  const auto first = std::move(thrown_.front());
  thrown_.erase(thrown_.begin());
  std::rethrow_exception(first);
}

Connection& Connections::add(std::uint32_t index, std::unique_ptr<Link> link) try {
  while (all_.size() <= index) all_.push_back(Connection::take());
  auto& connection = *all_[index];
  const auto incarnation = link->header().incarnation;
  std::vector<std::atomic<std::uint64_t>> unanswered(std::bit_ceil(link->maxOutstanding()));
  auto channel = MessageLink::make(std::move(link), connection.lock);
  byLink_[incarnation] = &connection;
  {
    const BiasedLock::Guard lock(*connection.lock);
    connection.index = index;
    connection.clientGeneration = connection.generation;
    connection.lastId = 0;
    connection.timedId = 0;
    connection.unanswered = std::move(unanswered);
    connection.unansweredMask = static_cast<std::uint32_t>(connection.unanswered.size() - 1);
    connection.channel = std::move(channel);
  }
  MPF_STEP(link_opened);
  return connection;
} catch (...) {
  endpoint_.detach(index);
  throw;
}

void Connections::open(Connection& connection) {
  auto& link = connection.channel->link();
  endpoint_.attach(connection.index, link, connection);
  count(endpoint_.control().linksOpened);
  link.control().serverIndex.store(connection.index, std::memory_order_relaxed);
  link.setState(layout::LinkState::open);
  MPF_STEP(link_accepted);
  link.notifyPeer();
  reportClient(connection.client(), true);
}

void Connections::close(Connection& connection) noexcept {
  const auto client = connection.client();
  std::shared_ptr<MessageLink> channel;
  {
    const BiasedLock::Guard lock(*connection.lock);
    channel = std::move(connection.channel);
    connection.channel.reset();
    ++connection.generation;
    channel->link().endFanOut();
  }
  MPF_STEP(link_closing);
  endpoint_.detach(connection.index);
  byLink_.erase(channel->link().header().incarnation);
  channel->link().setState(layout::LinkState::closed);
  channel->link().notifyPeer();
  count(endpoint_.control().linksClosed);
  reportClient(client, false);
  auto window = channel->link().peer();
  channel.reset();
  endpoint_.peers().release(std::move(window));
}

void Connections::closeIfClientClosed(Connection& connection) noexcept {
  auto& link = connection.channel->link();
  if (link.peerState() == layout::LinkState::open || link.incoming().hasMessage()) return;
  if (link.isLost()) count(endpoint_.control().protocolErrors);
  close(connection);
}

void Connections::closeDead() noexcept {
  for (const auto& connection : all_) {
    if (!connection->channel || !connection->channel->link().peer()->isDead()) continue;
    auto& link = connection->channel->link();
    MPF_STEP(client_died);
    removeFilesOf(link);
    MPF_STEP(client_removed);
    // If the client closed the link before it died, closeIfClientClosed() closes the connection
    // after the requests that remain.
    if (link.peerState() == layout::LinkState::closed && link.incoming().hasMessage()) continue;
    count(endpoint_.control().peersDied);
    close(*connection);
  }
}

// The client owned the link and has died, so the server may remove its names. Without memory for
// them, they stay until another process attaches to the backplane or removes them.
void Connections::removeFilesOf(const Link& link) noexcept try {
  Link::removeFiles(endpoint_.backplane().name(), link.name(), link.header().incarnation);
  // NOLINTNEXTLINE(bugprone-empty-catch): as above
} catch (const std::exception&) {
}

void Connections::removeClientOf(const Link& link) noexcept try {
  removeFilesOf(link);
  stale_segments::removeDeadWindow(endpoint_.backplane().name(), link.peer()->name(),
                                   link.peer()->header().incarnation);
  // NOLINTNEXTLINE(bugprone-empty-catch): as above
} catch (const std::exception&) {
}

// Also removes the files of clients whose death the server has not noticed yet: no later call will.
//
// Clients of other users cannot remove the server's pool files, and none can remove those of the
// fan-out pool, so the server removes them itself: these clients are returned.
Connections::Channels Connections::closeAll() noexcept {
  Channels others;
  for (const auto& connection : all_) {
    if (!connection->channel) continue;
    auto& link = connection->channel->link();
    if (!link.peer()->hasOwner()) removeClientOf(link);
    else if (!link.tryLeavePoolToClient() || isBorrowing(*connection))
      keep(connection->channel, others);
    close(*connection);
  }
  return others;
}

void Connections::drain(const Channels& channels) noexcept {
  const auto deadline = Deadline::after(kDrainTimeout);
  const auto isReceiving = [](const auto& channel) { return !channel->link().hasPeerEnded(); };
  while (std::ranges::any_of(channels, isReceiving) && !deadline.hasPassed())
    std::this_thread::sleep_for(kDrainPoll);
}

std::uint64_t Connections::clientOf(const Route& request) noexcept {
  const auto* const connection = Connection::tryOf(request);
  if (connection == nullptr) return 0;
  const BiasedLock::Guard lock(*connection->lock);
  return connection->isOpenFor(request) ? connection->client() : 0;
}

bool Connections::isConnected(const Route& request) noexcept {
  const auto* const connection = Connection::tryOf(request);
  if (connection == nullptr) return false;
  const BiasedLock::Guard lock(*connection->lock);
  if (!connection->isOpenFor(request)) return false;
  const auto& link = connection->channel->link();
  return link.peerState() == layout::LinkState::open && !link.peer()->isDead();
}

Route Connections::routeTo(std::uint64_t client) const noexcept {
  const auto number = client >> 32;
  if (number == 0 || number > all_.size()) return {};
  return {reinterpret_cast<std::uint64_t>(all_[number - 1].get()), 0,
          static_cast<std::uint32_t>(client), nullptr};
}

Route Connections::routeTo(std::uint64_t client, std::uint32_t requestId) const noexcept {
  const auto route = routeTo(client);
  auto* const connection = Connection::tryOf(route);
  if (connection == nullptr) return route;
  const BiasedLock::Guard lock(*connection->lock);
  return connection->isOpenFor(route) ? connection->routeTo(requestId) : route;
}

bool Connections::isUnanswered(std::uint64_t client, std::uint32_t requestId) const noexcept {
  const auto route = routeTo(client);
  auto* const connection = Connection::tryOf(route);
  if (connection == nullptr) return false;
  const BiasedLock::Guard lock(*connection->lock);
  return connection->isOpenFor(route) && connection->isUnanswered(requestId);
}

std::vector<std::uint32_t> Connections::unanswered(std::uint64_t client) const {
  const auto route = routeTo(client);
  std::vector<std::uint32_t> ids;
  const auto* const connection = Connection::tryOf(route);
  if (connection == nullptr) return ids;
  const BiasedLock::Guard lock(*connection->lock);
  if (!connection->isOpenFor(route)) return ids;
  for (const auto& place : connection->unanswered) {
    const auto id = detail::firstOf(place.load(std::memory_order_relaxed));
    if (id != 0) ids.push_back(id);
  }
  return ids;
}

}  // namespace mpf
