// SPDX-License-Identifier: MIT
#include "server/server_core.h"

#include <fmt/format.h>
#include <mutex>
#include <stdexcept>

#include "base/step.h"
#include "shm/histogram.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

// More than the number of links, so that receive() looks at each link.
constexpr std::uint32_t kMaxLooks = 2 * layout::kMaxLinks;

int checkedQueueSize(int size) {
  if (size < 1 || size > static_cast<int>(LinkGeometry::kMaxQueueSize)) {
    throw std::invalid_argument(
        fmt::format("queue size {}: use 1 to {}", size, LinkGeometry::kMaxQueueSize));
  }
  return size;
}

std::string windowName(const Backplane& backplane, const std::string& name, std::int32_t location) {
  SegmentName::checkServer(name);
  return SegmentName::serverWindow(backplane.name(), location, name);
}

}  // namespace

ServerCore::ServerCore(const Backplane& backplane, const std::string& name,
                       const ServerOptions& options)
    : name_(name),
      location_(options.location),
      endpoint_(
          backplane, layout::SegmentKind::serverWindow,
          windowName(backplane, name, options.location), options.rights, options.waitMode,
          [&](layout::SegmentHeader& header) {
            const auto queueSize = static_cast<std::uint32_t>(checkedQueueSize(options.queueSize));
            header.location = options.location;
            name.copy(header.name.data(), header.name.size() - 1);
            header.queueSize = queueSize;
            header.maxMessageBytes = options.maxMessageBytes;
            header.maxPoolBytes = options.maxPoolBytes;
            auto* control = reinterpret_cast<std::byte*>(&header) + layout::kWindowControlOffset;
            reinterpret_cast<layout::WindowControl*>(control)->queueSize.store(
                queueSize, std::memory_order_relaxed);
          }),
      connections_(endpoint_),
      acceptor_(endpoint_, connections_),
      replies_(endpoint_.control(), options.stampsReplies),
      publisher_(backplane.name(), endpoint_.window(), options),
      keeper_(RequestKeeper::make(replies_)),
      progress_(endpoint_.control()) {}

ServerCore::~ServerCore() {
  keeper_.leave();
  if (endpoint_.forkGuard().isInherited()) return;
  MPF_STEP(server_leaving);
  endpoint_.control().state.store(layout::WindowState::closed, std::memory_order_relaxed);
  connections_.onClient(nullptr);
  connections_.closeAll();
}

void ServerCore::setQueueSize(int size) {
  endpoint_.control().queueSize.store(static_cast<std::uint32_t>(checkedQueueSize(size)),
                                      std::memory_order_relaxed);
}

bool ServerCore::wait(Deadline deadline) {
  endpoint_.forkGuard().check("MessageServer");
  endHandling();
  const auto stopped = [this] {
    return stop_.load(std::memory_order_relaxed) &&
           stop_.exchange(false, std::memory_order_relaxed);
  };
  return !stopped() && endpoint_.wait(deadline) && !stopped();
}

void ServerCore::interrupt() noexcept {
  stop_.store(true, std::memory_order_relaxed);
  endpoint_.interrupt();
}

int ServerCore::descriptor() {
  hasDescriptor_ = true;
  static_cast<void>(endpoint_.arm());
  return endpoint_.descriptor();
}

void ServerCore::handleControlEvents() {
  acceptor_.acceptAll();
  if (endpoint_.takeLocalEvent() && endpoint_.takePeerDeath()) connections_.closeDead();
}

Message ServerCore::receive() {
  endpoint_.forkGuard().check("MessageServer");
  Message message;
  // Limited, because faulty clients may set hints without end, and receive() must return.
  for (std::uint32_t looks = 0; looks < kMaxLooks; ++looks) {
    if (endpoint_.hasControlEvents()) handleControlEvents();
    if (connections_.hasThrown()) throwNext();
    const auto index = endpoint_.next();
    if (index && take(*connections_.all()[*index], message)) return message;
    if (!index && (!hasDescriptor_ || endpoint_.arm())) {
      endHandling();
      return message;
    }
  }
  endHandling();
  keepReadable();
  return message;
}

void ServerCore::keepReadable() noexcept {
  if (hasDescriptor_) endpoint_.keepReadable();
}

void ServerCore::throwNext() {
  // More exceptions or requests may wait: the next wait() returns immediately.
  endpoint_.interrupt();
  connections_.throwNext();
}

void ServerCore::closeForProtocolError(Connection& connection) noexcept {
  count(endpoint_.control().protocolErrors);
  connections_.close(connection);
}

bool ServerCore::take(Connection& connection, Message& message) noexcept {
  if (!connection.channel) return false;
  auto& control = endpoint_.control();
  Envelope envelope;
  switch (connection.channel->tryBegin(envelope)) {
    case MessageLink::Take::nothing:
      connections_.closeIfClientDid(connection);
      return false;
    case MessageLink::Take::invalid:
      closeForProtocolError(connection);
      return false;
    case MessageLink::Take::message:
      break;
  }
  count(control.received);
  count(control.progress);
  if (!connection.tryOwe(envelope.requestId)) {
    closeForProtocolError(connection);
    return false;
  }
  MPF_STEP(request_taken);
  if (envelope.timeNs != 0 && hasExpired(envelope)) {
    count(control.expired);
    connection.channel->discard(envelope);
    replies_.sendFate(connection, envelope, Fate::expired);
    return false;
  }
  switch (connection.channel->tryFinish(envelope, message)) {
    case MessageLink::Finish::invalid:
      closeForProtocolError(connection);
      return false;
    case MessageLink::Finish::unavailable:
      count(control.refused);
      replies_.sendFate(connection, envelope, Fate::refused);
      return false;
    case MessageLink::Finish::message:
      break;
  }
  if (envelope.sentTick != 0) {
    noteTimes(connection, envelope);
  } else if (progress_.isSlow()) {
    progress_.note(Clock::nowNs());
  }
  progress_.begin(message);
  message.setRoute(connection.routeOf(envelope.requestId, &keeper_));
  takeBefore_ = envelope.timeNs == 0 ? Deadline::never() : Deadline::atNs(envelope.timeNs);
  return true;
}

bool ServerCore::hasExpired(Envelope envelope) noexcept {
  // PAIR(taken-before-clock): the client sees that the server counted the request as taken, or the
  // server sees that the deadline has passed.
  doorbell::fence();
  return Clock::nowNs() >= envelope.timeNs;
}

void ServerCore::noteTimes(Connection& connection, Envelope envelope) noexcept {
  const auto nowNs = Clock::nowNs();
  const auto waitedNs = Tick::nsSince(envelope.sentTick, nowNs);
  record(endpoint_.control().queueWaitNs, waitedNs);
  if (endpoint_.slept()) endpoint_.noteWake(waitedNs);
  progress_.note(nowNs);
  const std::lock_guard lock(*connection.lock);
  connection.timedId = envelope.requestId;
  connection.timedFromNs = nowNs;
}

ServerCore::Counts ServerCore::counts() const {
  const auto& control = endpoint_.control();
  Counts counts{control.queueSize.load(std::memory_order_relaxed), 0,
                control.received.load(std::memory_order_relaxed), 0,
                control.sent.load(std::memory_order_relaxed)};
  for (const auto& connection : connections_.all()) {
    const std::lock_guard lock(*connection->lock);
    if (!connection->channel) continue;
    const auto& link = connection->channel->link().control();
    const auto sent = link.clientSent.load(std::memory_order_relaxed);
    const auto taken = link.requests.taken.load(std::memory_order_relaxed);
    counts.inQueue += sent > taken ? sent - taken : 0;
    counts.queueFull += link.clientRefused.load(std::memory_order_relaxed);
  }
  return counts;
}

}  // namespace mpf
