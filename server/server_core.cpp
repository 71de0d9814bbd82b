// SPDX-License-Identifier: MIT
#include "server/server_core.h"

#include <fmt/format.h>
#include <list>
#include <mutex>
#include <new>
#include <stdexcept>
#include <utility>

#include "base/step.h"
#include "shm/histogram.h"
#include "shm/segment_name.h"

namespace mpf {

// Handles of requests may outlive their server, so keepers are never freed: they cost a few bytes
// for each server that the process creates.
class ServerCore::Keeper final : public RouteKeeper {
 public:
  static Keeper* make(ServerCore& server) {
    const std::lock_guard lock(mutex());
    all().emplace_back().server_ = &server;
    return &all().back();
  }
  void leave() noexcept {
    const std::lock_guard lock(mutex());
    server_ = nullptr;
  }
  void abandoned(const Route& route) noexcept override {
    const std::lock_guard lock(mutex());
    if (server_ != nullptr) server_->abandoned(route);
  }

 private:
  static std::mutex& mutex() {
    static auto* const theMutex = new std::mutex;
    return *theMutex;
  }
  static std::list<Keeper>& all() {
    static auto* const keepers = new std::list<Keeper>;
    return *keepers;
  }
  ServerCore* server_ = nullptr;
};

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
      keeper_(Keeper::make(*this)) {}

ServerCore::~ServerCore() {
  keeper_->leave();
  if (endpoint_.forkGuard().isInherited()) return;
  MPF_STEP(server_leaving);
  endpoint_.control().state.store(layout::WindowState::closed, std::memory_order_relaxed);
  onClient_ = nullptr;
  closeAll();
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

std::uint64_t ServerCore::clientOf(const Message& request) const noexcept {
  const auto route = request.route();
  if (route.link == 0) return 0;
  auto& connection = connectionOf(route);
  const std::lock_guard lock(*connection.lock);
  if (connection.generation != route.flags || !connection.channel) return 0;
  return nameOf(connection);
}

bool ServerCore::isAwaited(const Message& request) const noexcept {
  const auto route = request.route();
  if (route.link == 0) return false;
  auto& connection = connectionOf(route);
  const std::lock_guard lock(*connection.lock);
  if (connection.generation != route.flags || !connection.channel) return false;
  const auto& link = connection.channel->link();
  return link.peerState() == layout::LinkState::open && !link.peer()->isDead();
}

Route ServerCore::routeTo(std::uint64_t client, std::uint32_t requestId) const noexcept {
  const auto number = client >> 32;
  if (number == 0 || number > connections_.size()) return {};
  return {reinterpret_cast<std::uint64_t>(connections_[number - 1].get()), requestId,
          static_cast<std::uint32_t>(client), nullptr};
}

bool ServerCore::owes(std::uint64_t client, std::uint32_t requestId) const noexcept {
  const auto route = routeTo(client, requestId);
  if (route.link == 0 || requestId == 0) return false;
  auto& connection = connectionOf(route);
  const std::lock_guard lock(*connection.lock);
  return connection.generation == route.flags && connection.channel &&
         connection.owed(requestId).load(std::memory_order_relaxed) == requestId;
}

std::vector<std::uint32_t> ServerCore::owed(std::uint64_t client) const {
  const auto route = routeTo(client, 0);
  std::vector<std::uint32_t> ids;
  if (route.link == 0) return ids;
  auto& connection = connectionOf(route);
  const std::lock_guard lock(*connection.lock);
  if (connection.generation != route.flags || !connection.channel) return ids;
  for (const auto& place : connection.unanswered) {
    if (const auto id = place.load(std::memory_order_relaxed); id != 0) ids.push_back(id);
  }
  return ids;
}

int ServerCore::descriptor() {
  hasDescriptor_ = true;
  static_cast<void>(endpoint_.arm());
  return endpoint_.descriptor();
}

void ServerCore::handleControlEvents() {
  // Limited, because a faulty client may knock without end.
  for (std::uint32_t knocks = 0; knocks < layout::kKnocks; ++knocks) {
    const auto incarnation = endpoint_.knocks().tryTake();
    if (!incarnation) break;
    accept(*incarnation);
  }
  rescanDue_ = endpoint_.knocks().takeRescan() || rescanDue_;
  if (rescanDue_) acceptAll();
  if (endpoint_.takeLocalEvent() && endpoint_.takePeerDeath()) closeDead();
}

Message ServerCore::receive() {
  endpoint_.forkGuard().check("MessageServer");
  Message message;
  // Limited, because faulty clients may set hints without end, and receive() must return.
  for (std::uint32_t looks = 0; looks < kMaxLooks; ++looks) {
    if (endpoint_.hasControlEvents()) handleControlEvents();
    if (!thrown_.empty()) throwNext();
    const auto index = endpoint_.next();
    if (index && take(*connections_[*index], message)) return message;
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

// An exception must not interrupt a change of the links: receive() throws it afterwards.
void ServerCore::reportClient(std::uint64_t client, bool isConnected) noexcept try {
  if (onClient_) onClient_(client, isConnected);
} catch (...) {
  try {
    thrown_.push_back(std::current_exception());
  } catch (const std::bad_alloc&) {  // the exception is lost
  }
}

void ServerCore::throwNext() {
  const auto first = std::move(thrown_.front());
  thrown_.pop_front();
  // More exceptions or requests may wait: the next wait() returns immediately.
  endpoint_.interrupt();
  std::rethrow_exception(first);
}

bool ServerCore::take(Connection& connection, Message& message) noexcept {
  if (!connection.channel) return false;
  auto& control = endpoint_.control();
  Envelope envelope;
  switch (connection.channel->tryBegin(envelope)) {
    case MessageLink::Take::nothing:
      closeIfClientDid(connection);
      return false;
    case MessageLink::Take::invalid:
      count(control.protocolErrors);
      close(connection);
      return false;
    case MessageLink::Take::message:
      break;
  }
  count(control.received);
  count(control.progress);
  auto& unanswered = connection.owed(envelope.requestId);
  if (envelope.requestId == 0 || unanswered.load(std::memory_order_relaxed) != 0) {
    count(control.protocolErrors);
    close(connection);
    return false;
  }
  unanswered.store(envelope.requestId, std::memory_order_relaxed);
  MPF_STEP(request_taken);
  if (envelope.deadlineNs != 0 && hasExpired(envelope)) {
    count(control.expired);
    connection.channel->discard(envelope);
    sendFate(connection, envelope.requestId, envelope.clientType, envelope.clientExtra,
             Fate::expired);
    return false;
  }
  switch (connection.channel->tryFinish(envelope, message)) {
    case MessageLink::Finish::invalid:
      count(control.protocolErrors);
      close(connection);
      return false;
    case MessageLink::Finish::unavailable:
      count(control.refused);
      sendFate(connection, envelope.requestId, envelope.clientType, envelope.clientExtra,
               Fate::refused);
      return false;
    case MessageLink::Finish::message:
      break;
  }
  if (envelope.sentTick != 0) {
    noteTimes(connection, envelope);
  } else if (isSlow_) {
    noteProgress(Clock::nowNs());
  }
  beginHandling(message);
  message.setRoute({reinterpret_cast<std::uint64_t>(&connection), envelope.requestId,
                    connection.generation, keeper_});
  takeBefore_ = envelope.deadlineNs == 0 ? Deadline::never() : Deadline::atNs(envelope.deadlineNs);
  return true;
}

bool ServerCore::hasExpired(const Envelope& envelope) noexcept {
  // PAIR(taken-before-clock): the client sees that the server counted the request as taken, or the
  // server sees that the deadline has passed.
  doorbell::fence();
  return Clock::nowNs() >= envelope.deadlineNs;
}

void ServerCore::noteTimes(Connection& connection, const Envelope& envelope) noexcept {
  const auto nowNs = Clock::nowNs();
  const auto waitedNs = Tick::nsSince(envelope.sentTick, nowNs);
  record(endpoint_.control().queueWaitNs, waitedNs);
  if (endpoint_.slept()) endpoint_.noteWake(waitedNs);
  noteProgress(nowNs);
  const std::lock_guard lock(*connection.lock);
  connection.timedId = envelope.requestId;
  connection.timedFromNs = nowNs;
}

ReplyResult ServerCore::reply(Message& message) noexcept {
  if (!message || message.route().link == 0 || endpoint_.forkGuard().isInherited())
    return ReplyResult::clientGone;
  auto& connection = connectionOf(message.route());
  ReplyResult result{};
  {
    const std::lock_guard lock(*connection.lock);
    result = sendReply(connection, message);
  }
  if (result == ReplyResult::sent || result == ReplyResult::clientGone) message.reset();
  return result;
}

ReplyResult ServerCore::sendReply(Connection& connection, Message& message) noexcept {
  const auto route = message.route();
  if (connection.generation != route.flags || !connection.channel) {
    return ReplyResult::clientGone;
  }
  auto& unanswered = connection.owed(route.requestId);
  const bool first =
      route.requestId != 0 && unanswered.load(std::memory_order_relaxed) == route.requestId;
  const auto maxOutstanding = connection.channel->link().header().maxOutstanding;
  Envelope envelope;
  envelope.type = static_cast<std::uint16_t>(message.getType());
  envelope.flags = first ? layout::kSlotFirstReply : std::uint8_t{0};
  envelope.requestId = route.requestId;
  envelope.clientType = message.getClientType();
  envelope.clientExtra = message.getClientExtra();

  auto& link = connection.channel->link();
  if (link.shouldSampleTime()) envelope.sentTick = Tick::of(Clock::nowNs());

  auto unowned = route;
  unowned.keeper = nullptr;
  if (first) message.setRoute(unowned);
  const Link::Limits limits{0, first ? 0 : maxOutstanding, maxOutstanding};
  const auto result = connection.channel->trySendLocked(envelope, message, limits);
  if (result == LinkSend::sent || result == LinkSend::sentInPlace) {
    MPF_STEP(reply_sent);
    if (first) unanswered.store(0, std::memory_order_relaxed);
    count(endpoint_.control().sent);
    link.control().serverSent.store(link.outgoing().messages(), std::memory_order_relaxed);
    if (route.requestId == connection.timedId && first) {
      record(endpoint_.control().serviceNs, Clock::nowNs() - connection.timedFromNs);
      connection.timedId = 0;
    }
    return ReplyResult::sent;
  }
  if (first) message.setRoute(route);
  count(endpoint_.control().replyQueueFull);
  if (result == LinkSend::full) return ReplyResult::queueFull;
  return result == LinkSend::tooLarge ? ReplyResult::tooLarge : ReplyResult::noMemory;
}

void ServerCore::sendFate(Connection& connection, std::uint32_t requestId, std::int32_t clientType,
                          std::int32_t clientExtra, Fate fate) noexcept {
  RequestFateMessage message({.fate = fate, .requestId = requestId});
  message.setClientType(clientType);
  message.setClientExtra(clientExtra);
  message.setRoute(
      {reinterpret_cast<std::uint64_t>(&connection), requestId, connection.generation, nullptr});
  static_cast<void>(reply(message));
}

void ServerCore::abandoned(const Route& route) noexcept {
  auto& connection = connectionOf(route);
  const std::lock_guard lock(*connection.lock);
  if (connection.generation != route.flags || !connection.channel) return;
  if (connection.owed(route.requestId).load(std::memory_order_relaxed) != route.requestId) return;
  RequestFateMessage message({.fate = Fate::refused, .requestId = route.requestId});
  message.setRoute({route.link, route.requestId, route.flags, nullptr});
  if (sendReply(connection, message) == ReplyResult::sent) count(endpoint_.control().refused);
}

BodyBytes ServerCore::allocate(const Route& route, std::size_t bytes) {
  std::shared_ptr<MessageLink> channel;
  if (route.link != 0) {
    auto& connection = connectionOf(route);
    const std::lock_guard lock(*connection.lock);
    if (connection.generation == route.flags) channel = connection.channel;
  }
  return channel ? channel->allocate(bytes) : allocateHeapBody(bytes);
}

ServerCore::Counts ServerCore::counts() const {
  const auto& control = endpoint_.control();
  Counts counts{control.queueSize.load(std::memory_order_relaxed), 0,
                control.received.load(std::memory_order_relaxed), 0,
                control.sent.load(std::memory_order_relaxed)};
  for (const auto& connection : connections_) {
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
