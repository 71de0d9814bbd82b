// SPDX-License-Identifier: MIT
#include "router/outgoing/client_router.h"

#include <fmt/format.h>

#include "router/transport/kj_text.h"
#include "shm/link.h"

namespace mpf::router {
namespace {

constexpr std::int64_t kIdleProxyNs = 60'000'000'000;  // how long a proxy without clients is kept
constexpr std::int64_t kBindAgainNs = 2'000'000'000;  // pause after a refused bind
constexpr int kTurn = 16;  // requests of one server before those of the next server
constexpr int kMaxTurns = 256;  // turns before the event loop runs its other tasks
constexpr std::chrono::seconds kSweepEvery{1};  // while isPending() is true for a server

// A fate that only a newer peer defines becomes outcomeUnknown, which promises nothing.
Fate fateOf(wire::Fate fate) noexcept {
  return fate <= wire::Fate::CANCELLED ? static_cast<Fate>(fate) : Fate::outcomeUnknown;
}

// The largest queue size with which a local client has no more outstanding requests than the far
// server accepts from each of its clients.
std::uint32_t queueSizeOf(wire::Server::Reader server) {
  auto queueSize = std::min<std::uint32_t>(server.getQueueSize(), LinkGeometry::kMaxQueueSize);
  while (queueSize > 1 &&
         LinkGeometry::forQueue(queueSize).maxOutstanding > server.getMaxOutstanding())
    --queueSize;
  return queueSize;
}

}  // namespace

ClientRouter::ClientRouter(RouterContext& context, const Remote& remote)
    : context_(context),
      remote_(remote),
      record_(context.statistics.add(layout::RouterRole::client)),
      log_(context.log.forObject()),
      connector_(context, remote_),
      retryDelay_(context.config.limits.firstRetry),
      pumpAgain_(context.timer,
                 [this] {
                   if (line_) onRoom();
                 }),
      sweeps_(context.timer, [this] { sweep(); }) {
  record_->setAddress(remote.address.text());
  record_->setLocations(remote.locations);
  (*record_)->isTls.store(remote.security == Security::tls ? 1 : 0, std::memory_order_relaxed);
  (*record_)->queueSize.store(context.config.limits.queueSize, std::memory_order_relaxed);
  loop_ = connectLoop().fork();
  tasks_.add(loop_.addBranch());
}

ClientRouter::~ClientRouter() {
  if (line_) onLineEnd("the router is stopping");
}

kj::Promise<void> ClientRouter::stop() {
  stopping_ = true;
  if (!line_) return kj::READY_NOW;
  line_->end(FarewellCode::STOPPING, "the router is stopping");
  return loop_.addBranch();
}

// ---- the line

// A failure to connect is handled as the end of a line: the router waits and tries again.
kj::Promise<void> ClientRouter::connectLoop() {
  return kj::evalNow([this] { return runOnce(); })
      .then([this](const LineEnd& end) { onLineEnd(end.text); },
            [this](kj::Exception&& error) { onLineEnd(toStd(error.getDescription())); })
      .then([this]() -> kj::Promise<void> {
        if (stopping_) return kj::READY_NOW;
        return context_.timer.afterDelay(nextDelay()).then([this] { return connectLoop(); });
      });
}

// Returns a random time between half of the delay and all of it, so that routers which lost the
// same peer at the same moment do not reconnect at the same moment.
kj::Duration ClientRouter::nextDelay() {
  const auto halfMs = retryDelay_.count() / 2;
  retryDelay_ = std::min(2 * retryDelay_, context_.config.limits.lastRetry);
  return (halfMs + static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(halfMs + 1))) *
         kj::MILLISECONDS;
}

kj::Promise<LineEnd> ClientRouter::runOnce() {
  record_->setState(layout::RouterLineState::connecting);
  return connector_.connect().then([this](kj::Own<kj::AsyncIoStream> stream) {
    line_ = std::make_unique<Line>(kj::mv(stream), context_.timer, context_.config.limits, *record_,
                                   *this);
    return line_->run(
        [this](wire::Item::Builder item) { fillGreeting(item.initGreeting(), context_); });
  });
}

void ClientRouter::onGreeting(const PeerGreeting& greeting) {
  connected_ = true;
  connectedNs_ = Clock::nowNs();
  problem_.clear();
  count((*record_)->connects);
  record_->setState(layout::RouterLineState::connected);
  record_->setProblem({});
  log_.info("connected to {} at {} ({})", greeting.router, remote_.address.text(),
            greeting.program);
  bindWanted();
}

// Requests that were never written to the connection end as neverTaken. All others end at the local
// clients when the proxies are destroyed, as with any server that exits.
void ClientRouter::onLineEnd(const std::string& why) {
  if (!stopping_ && (connected_ || problem_ != why)) {
    log_.warn("{} {}: {}", connected_ ? "lost the connection to" : "cannot reach",
              remote_.address.text(), why);
  }
  problem_ = why;
  // The delay grows also when a peer greets and closes the connection soon afterwards.
  const bool lasted =
      connected_ && Clock::nowNs() - connectedNs_ >=
                        std::chrono::nanoseconds(context_.config.limits.deadTime).count();
  if (lasted) retryDelay_ = context_.config.limits.firstRetry;
  connected_ = false;
  record_->setState(layout::RouterLineState::waiting);
  record_->setProblem(why);
  (*record_)->inQueue.store(0, std::memory_order_relaxed);
  (*record_)->roundTripNs.store(0, std::memory_order_relaxed);
  if (line_) {
    for (const auto& carried : line_->takeUnsentRequests()) {
      if (auto* proxy = proxyOf(carried.client))
        proxy->endRequest(carried.client, carried.requestId, Fate::neverTaken, why);
    }
  }
  for (auto& [name, wanted] : wanted_) {
    wanted.proxy.reset();
    wanted.offer.reset();
    wanted.binding = 0;
    wanted.bindAgainNs = 0;
  }
  bindings_.clear();
  clients_.clear();
  lastBinding_ = lastClient_ = 0;
  maxClientsLogged_ = false;
  line_.reset();
}

// ---- servers that local clients use or wait for

void ClientRouter::setPendingBinds(const std::set<ServerName>& pendingBinds) {
  for (auto& [name, wanted] : wanted_) {
    if (!pendingBinds.contains(name) && wanted.idleSinceNs == 0)
      wanted.idleSinceNs = Clock::nowNs();
  }
  for (const auto& name : pendingBinds) {
    if (std::ranges::find(remote_.locations, name.location) != remote_.locations.end())
      wanted_[name].idleSinceNs = 0;
  }
  bindWanted();
  sweepSoon();
}

void ClientRouter::bindWanted() {
  (*record_)->bindings.store(wanted_.size(), std::memory_order_relaxed);
  if (!connected_) return;
  for (auto& [name, wanted] : wanted_) {
    if (wanted.binding == 0 && Clock::nowNs() >= wanted.bindAgainNs) bind(name, wanted);
  }
}

void ClientRouter::bind(const ServerName& name, Wanted& wanted) {
  wanted.binding = ++lastBinding_;
  bindings_[wanted.binding] = name;
  line_->send([binding = wanted.binding, name](wire::Item::Builder item) {
    auto bind = item.initBind();
    bind.setBinding(binding);
    bind.setLocation(name.location);
    bind.setServer(name.server);
  });
}

void ClientRouter::onServer(wire::Server::Reader server) {
  const auto binding = bindings_.find(server.getBinding());
  if (binding == bindings_.end()) return;  // it was unbound while this item was on its way
  auto& wanted = wanted_.at(binding->second);
  switch (server.getState()) {
    case wire::Server::State::THERE:
      wanted.offer = Proxy::Offer{server.getBinding(), server.getIncarnation(), queueSizeOf(server),
                                  server.getMaxMessageBytes()};
      if (wanted.proxy) wanted.proxy->drain(Fate::neverTaken);  // it was for an earlier incarnation
      break;
    case wire::Server::State::REFUSED:
      onRefusal(binding->second, wanted, displayText(server.getReason()));
      bindings_.erase(binding);
      wanted.offer.reset();
      if (wanted.proxy) wanted.proxy->drain(Fate::outcomeUnknown);
      break;
    case wire::Server::State::ABSENT:  // no request without an end was taken there
      wanted.offer.reset();
      if (wanted.proxy) wanted.proxy->drain(Fate::neverTaken);
      break;
    default:  // a state that only a newer peer defines
      wanted.offer.reset();
      if (wanted.proxy) wanted.proxy->drain(Fate::outcomeUnknown);
      break;
  }
  sweep();
}

// Binds again after a while, since the configuration of the peer may change.
void ClientRouter::onRefusal(const ServerName& name, Wanted& wanted, const std::string& why) {
  if (wanted.problem != why)
    log_.warn("{} at location {}: {} refused the bind: {}", name.server, name.location,
              remote_.address.text(), why);
  wanted.problem = why;
  wanted.binding = 0;
  wanted.bindAgainNs = Clock::nowNs() + kBindAgainNs;
}

void ClientRouter::makeProxy(const ServerName& name, Wanted& wanted) try {
  if (!wanted.offer) return;
  wanted.proxy = std::make_unique<Proxy>(context_, *this, name, *wanted.offer);
  wanted.offer.reset();
  wanted.problem.clear();
  log_.info("{} at location {} is available", name.server, name.location);
} catch (const std::exception& error) {
  if (wanted.problem != error.what())
    log_.warn("{} at location {} cannot be offered here: {}", name.server, name.location,
              error.what());
  wanted.problem = error.what();
}

// Destroys proxies that are done, makes proxies for new offers, and unbinds servers that no client
// has used or waited for during kIdleProxyNs.
void ClientRouter::sweep() {
  const auto nowNs = Clock::nowNs();
  for (auto each = wanted_.begin(); each != wanted_.end();) {
    auto& [name, wanted] = *each;
    if (wanted.proxy && wanted.proxy->isDone()) {
      log_.info("{} at location {} is no longer available", name.server, name.location);
      wanted.proxy.reset();
    }
    if (!wanted.proxy && wanted.offer && connected_) makeProxy(name, wanted);
    if (wanted.proxy && wanted.proxy->hasClients()) wanted.idleSinceNs = 0;
    else if (wanted.proxy && wanted.idleSinceNs == 0) wanted.idleSinceNs = nowNs;
    if (wanted.idleSinceNs == 0 || nowNs - wanted.idleSinceNs < kIdleProxyNs) {
      ++each;
      continue;
    }
    if (connected_ && wanted.binding != 0)
      line_->send(
          [binding = wanted.binding](wire::Item::Builder item) { item.setUnbind(binding); });
    bindings_.erase(wanted.binding);
    each = wanted_.erase(each);
  }
  bindWanted();
  if (std::ranges::any_of(wanted_, [this](const auto& each) { return isPending(each.second); }))
    sweepSoon();
}

// Whether a later sweep may have something to do even if no event occurs before it.
bool ClientRouter::isPending(const Wanted& wanted) const {
  return wanted.idleSinceNs != 0 || (wanted.binding == 0 && connected_) ||
         (wanted.offer && !wanted.proxy) || (wanted.proxy && wanted.proxy->isDraining());
}

void ClientRouter::sweepSoon() { sweeps_.setAt(Deadline::after(kSweepEvery)); }

// ---- from the line

Proxy* ClientRouter::proxyOf(std::uint32_t client) {
  const auto found = clients_.find(client);
  return found == clients_.end() ? nullptr : found->second;
}

// Naming a client that was never opened is a protocol error.
Proxy* ClientRouter::openedProxyOf(std::uint32_t client) {
  if (client == 0 || client > lastClient_)
    throw ProtocolError(FarewellCode::PROTOCOL, fmt::format("client {} was never opened", client));
  return proxyOf(client);
}

std::optional<std::uint32_t> ClientRouter::tryNewClient(Proxy& proxy) {
  const auto most = line_->peer().maxClients;
  if (most != 0 && clients_.size() >= most) {
    if (!std::exchange(maxClientsLogged_, true))
      log_.warn(
          "{} accepts at most {} clients per connection (its max-clients): further clients are "
          "refused",
          remote_.address.text(), most);
    return std::nullopt;
  }
  if (lastClient_ == UINT32_MAX) {
    line_->end(FarewellCode::STOPPING, "all client numbers have been used");
    return std::nullopt;
  }
  clients_[++lastClient_] = &proxy;
  (*record_)->clients.store(clients_.size(), std::memory_order_relaxed);
  return lastClient_;
}

void ClientRouter::dropClient(std::uint32_t number) {
  clients_.erase(number);
  sweepSoon();  // this may have been the last client of its proxy
  (*record_)->clients.store(clients_.size(), std::memory_order_relaxed);
}

// Items for a client that has disconnected in the meantime are ignored.
void ClientRouter::onItem(wire::Item::Reader item) {
  switch (item.which()) {
    case wire::Item::SERVER:
      return onServer(item.getServer());
    case wire::Item::REPLY:
      if (auto* proxy = openedProxyOf(item.getReply().getClient())) {
        proxy->reply(item.getReply().getClient(), item.getReply());
        if (proxy->isDone()) sweep();
      }
      return;
    case wire::Item::FATE: {
      const auto end = item.getFate();
      auto* proxy = openedProxyOf(end.getClient());
      if (proxy == nullptr) return;
      proxy->endRequest(end.getClient(), end.getRequestId(), fateOf(end.getFate()),
                        displayText(end.getReason()));
      if (proxy->isDone()) sweep();
      return;
    }
    case wire::Item::QUEUE_FULL:
      if (auto* proxy = openedProxyOf(item.getQueueFull())) proxy->queueFull(item.getQueueFull());
      return;
    case wire::Item::REFUSE:
      if (auto* proxy = openedProxyOf(item.getRefuse().getClient()))
        proxy->refuse(item.getRefuse().getClient(), displayText(item.getRefuse().getReason()));
      return;
    case wire::Item::BIND:
    case wire::Item::UNBIND:
    case wire::Item::OPEN:
    case wire::Item::CLOSE:
    case wire::Item::REQUEST:
    case wire::Item::CREDIT:
      throw ProtocolError(FarewellCode::PROTOCOL, "an item that only a client router sends");
    default:  // an item that only a newer peer defines
      return;
  }
}

// Takes up to kTurn requests of each server in turn, beginning after pumped_, so that a flood of
// requests to one server does not delay requests to the others.
void ClientRouter::onRoom() {
  auto next = wanted_.upper_bound(pumped_);
  const ServerName* pumped = nullptr;
  std::size_t idle = 0;
  for (int turns = 0; turns < kMaxTurns && idle < wanted_.size() && line_->hasRoom(); ++next) {
    if (next == wanted_.end()) next = wanted_.begin();
    ++idle;
    auto& proxy = next->second.proxy;
    if (!proxy || !proxy->hasMore()) continue;
    ++turns;
    pumped = &next->first;
    if (proxy->pump(kTurn)) idle = 0;
  }
  if (pumped != nullptr) pumped_ = *pumped;
  if (idle < wanted_.size() && line_->hasRoom()) pumpAgain_.setAt(Deadline::after(Nanoseconds(0)));
}

void ClientRouter::onUnsendable(const Carried& carried, const std::string& why,
                                wire::Item::Builder /*instead*/) {
  log_.warn("a request cannot be sent to {} and is refused: {}", remote_.address.text(), why);
  if (auto* proxy = proxyOf(carried.client))
    proxy->endRequest(carried.client, carried.requestId, Fate::refused, why);
}

}  // namespace mpf::router
