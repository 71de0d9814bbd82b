// SPDX-License-Identifier: MIT
// ServerCore: accepts clients and closes their connections.
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>

#include "base/step.h"
#include "server/server_core.h"
#include "shm/histogram.h"
#include "shm/segment_name.h"
#include "shm/stale_segments.h"

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kDrainTimeout{100};
constexpr std::chrono::microseconds kDrainPoll{500};
constexpr std::size_t kMaxLinksPerRescan = 1024;
constexpr std::int64_t kRestAfterRescan = 9;  // times the duration of the rescan

// The shortage of this process or host that made an operation fail, if `error` says so.
layout::Shortage shortageOf(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) return layout::Shortage::memory;
  const auto* failed = dynamic_cast<const std::system_error*>(&error);
  switch (failed != nullptr ? failed->code().value() : 0) {
    case EMFILE:
      return layout::Shortage::descriptors;
    case ENFILE:
      return layout::Shortage::openFiles;
    case ENOMEM:
      return layout::Shortage::memory;
    default:
      return layout::Shortage::none;
  }
}

}  // namespace

// Accepts clients whose knock was lost. Any user may fill /dev/shm with names and any client may
// request a rescan, so rescans use at most a tenth of the server's time. A client that a rescan
// does not find knocks again.
void ServerCore::acceptAll() {
  const auto fromNs = Clock::nowNs();
  if (fromNs < rescanFromNs_) return;
  rescanDue_ = false;
  const auto prefix = SegmentName::linkPrefix(endpoint_.backplane().name(),
                                              endpoint_.window().header().incarnation);
  std::size_t accepted = 0;
  for (const auto& name : segments::list(prefix)) {
    const auto parsed = SegmentName::tryParse(name);
    if (!parsed || byLink_.contains(parsed->incarnation)) continue;
    if (++accepted > kMaxLinksPerRescan) break;
    accept(parsed->incarnation);
  }
  const auto nowNs = Clock::nowNs();
  rescanFromNs_ = nowNs + kRestAfterRescan * (nowNs - fromNs);
}

void ServerCore::accept(std::uint64_t incarnation) {
  if (byLink_.contains(incarnation)) return;
  try {
    const auto& backplane = endpoint_.backplane().name();
    const auto name =
        SegmentName::link(backplane, endpoint_.window().header().incarnation, incarnation);
    auto link = Link::tryOpen(backplane, name, endpoint_.window());
    if (!link) return;
    const auto window =
        SegmentName::keyed(backplane, NameKind::clientWindow, link->header().clientWindow);
    auto client = endpoint_.peers().tryOpen(window, layout::SegmentKind::clientWindow);
    if (client && link->peerState() == layout::LinkState::open)
      return open(std::move(link), std::move(client));
    // A client creates its window before its links and removes it after them: without a window,
    // this client died after it had created the link.
    if (!client && segments::probeOwner(window) == segments::Owner::absent)
      removeLink(name, incarnation);
  } catch (const std::exception& error) {
    // The client is not accepted and knocks again; the server continues.
    const auto shortage = shortageOf(error);
    if (shortage == layout::Shortage::none) return count(endpoint_.control().protocolErrors);
    noteShortage(shortage, error.what());
  }
}

// Each shortage counts as one alarm, for any number of clients that the server cannot accept.
void ServerCore::noteShortage(layout::Shortage shortage, const std::string& why) {
  auto& control = endpoint_.control();
  const auto was = control.shortage.load(std::memory_order_relaxed);
  if (was == shortage) return;
  control.shortage.store(shortage, std::memory_order_relaxed);
  const bool isOver = shortage == layout::Shortage::none;
  if (!isOver && was == layout::Shortage::none) countAlarm();
  if (onShortage_) onShortage_(isOver ? std::string() : why);
}

void ServerCore::open(std::unique_ptr<Link> link, std::shared_ptr<PeerWindow> client) {
  const auto index = endpoint_.tryReserve();
  link->attachPeer(std::move(client), link->header().clientIndex);
  if (!index) {
    link->setState(layout::LinkState::refused);
    link->notifyPeer();
    return;
  }
  if (*index >= connections_.size()) connections_.resize(*index + 1);
  if (!connections_[*index]) connections_[*index] = Connection::take();
  auto& connection = *connections_[*index];
  auto& opened = *link;
  {
    const std::lock_guard lock(*connection.lock);
    connection.index = *index;
    connection.timedId = 0;
    connection.unanswered =
        std::vector<std::atomic<std::uint32_t>>(std::bit_ceil(opened.header().maxOutstanding));
    connection.unansweredMask = static_cast<std::uint32_t>(connection.unanswered.size() - 1);
    connection.channel = std::make_shared<MessageLink>(std::move(link), connection.lock);
  }
  MPF_STEP(link_opened);
  noteShortage(layout::Shortage::none, {});
  byLink_[opened.header().incarnation] = &connection;
  endpoint_.attach(*index, opened);
  count(endpoint_.control().linksOpened);
  opened.control().serverIndex.store(*index, std::memory_order_relaxed);
  opened.setState(layout::LinkState::open);
  MPF_STEP(link_accepted);
  opened.notifyPeer();
  reportClient(nameOf(connection), true);
}

void ServerCore::closeIfClientDid(Connection& connection) noexcept {
  auto& link = connection.channel->link();
  if (link.peerState() == layout::LinkState::open || link.incoming().hasMessage()) return;
  if (link.isLost()) count(endpoint_.control().protocolErrors);
  close(connection);
}

void ServerCore::closeDead() {
  for (const auto& connection : connections_) {
    if (!connection->channel || !connection->channel->link().peer()->isDead()) continue;
    MPF_STEP(client_died);
    removeLinkOfDead(*connection);
    MPF_STEP(client_removed);
    // If the client closed the link before it died, take() closes the connection after the requests
    // that remain.
    const auto& link = connection->channel->link();
    if (link.peerState() == layout::LinkState::closed && link.incoming().hasMessage()) continue;
    count(endpoint_.control().peersDied);
    close(*connection);
  }
}

// The client owned the link and has died, so the server may remove its names.
void ServerCore::removeLinkOfDead(const Connection& connection) noexcept {
  const auto& link = connection.channel->link();
  removeLink(link.name(), link.header().incarnation);
}

void ServerCore::removeLink(const std::string& name, std::uint64_t incarnation) noexcept {
  segments::remove(name);
  removeBulk(endpoint_.backplane().name(), incarnation);
}

// Also removes the files of clients whose death the server has not noticed yet: no later call will.
void ServerCore::closeAll() noexcept {
  std::vector<std::shared_ptr<MessageLink>> others;
  for (const auto& connection : connections_) {
    if (!connection->channel) continue;
    auto& link = connection->channel->link();
    if (!link.peer()->hasOwner()) {
      removeLinkOfDead(*connection);
      stale_segments::removeDeadWindow(endpoint_.backplane().name(), link.peer()->name(),
                                       link.peer()->header().incarnation);
    } else if (!link.tryLeavePoolToClient()) {
      others.push_back(connection->channel);
    }
    close(*connection);
  }
  // Clients of other users cannot remove the server's pool files, so the server removes them
  // itself. It first gives these clients a moment to receive the replies that are in the pool.
  const auto deadline = Deadline::after(kDrainTimeout);
  const auto isReceiving = [](const auto& channel) { return !channel->link().hasPeerEnded(); };
  while (std::ranges::any_of(others, isReceiving) && !deadline.hasPassed())
    std::this_thread::sleep_for(kDrainPoll);
}

void ServerCore::close(Connection& connection) noexcept {
  const auto name = nameOf(connection);
  std::shared_ptr<MessageLink> channel;
  {
    const std::lock_guard lock(*connection.lock);
    channel = std::move(connection.channel);
    connection.channel.reset();
    ++connection.generation;
  }
  MPF_STEP(link_closing);
  endpoint_.detach(connection.index);
  byLink_.erase(channel->link().header().incarnation);
  channel->link().setState(layout::LinkState::closed);
  channel->link().notifyPeer();
  count(endpoint_.control().linksClosed);
  reportClient(name, false);
}

}  // namespace mpf
