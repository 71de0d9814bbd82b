// SPDX-License-Identifier: MIT
#include "router/outgoing/remote_servers.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include "router/transport/kj_text.h"
#include "shm/link.h"
#include "shm/segment_name.h"
#include "shm/window.h"

namespace mpf::router {
namespace {

constexpr std::int64_t kIdleProxyNs = 60'000'000'000;  // how long a proxy without clients is kept
constexpr std::int64_t kBindAgainNs = 2'000'000'000;  // pause after a refused bind
// How long the pools of an ended proxy are kept for clients that have not received its replies.
constexpr auto kReceiveTime = 100 * kj::MILLISECONDS;
constexpr int kTurn = 16;  // requests of one server before those of the next server
constexpr int kMaxTurns = 256;  // turns before the event loop runs its other tasks
constexpr std::chrono::seconds kSweepEvery{1};  // while isPending() is true for a server

[[noreturn]] void rejectClientRouterItem() {
  throw ProtocolError(FarewellCode::PROTOCOL, "received an item that only a client router sends");
}

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

RemoteServers::RemoteServers(RouterContext& context, const Remote& remote, PeerRecord& record,
                             const Log& log)
    : context_(context),
      remote_(remote),
      record_(record),
      log_(log),
      pumpAgain_(context.timer, [this] { pump(); }),
      sweeps_(context.timer, [this] { sweep(); }) {}

// ---- the connection

void RemoteServers::connect(Line& line) {
  connection_ = std::make_unique<RemoteConnection>(
      line, record_, log_, remote_.address.text(),
      [this] { sweepSoon(); });  // this may have been the last client of its proxy
  bindWanted();
}

void RemoteServers::disconnect(const std::string& why) {
  if (!connection_) return;
  for (const auto& request : connection_->line().takeUnsentRequests()) {
    if (auto* proxy = connection_->proxyOf(request.client))
      proxy->endRequest(request.client, request.requestId, Fate::neverTaken, why);
  }
  for (auto& [name, wanted] : wanted_) {
    endProxy(wanted);
    wanted.offer.reset();
    wanted.binding = 0;
    wanted.bindAgainNs = 0;
  }
  bindings_.clear();
  lastBinding_ = 0;
  connection_.reset();
}

// ---- bindings

void RemoteServers::setPendingBinds(const std::set<ServerName>& pendingBinds) {
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

void RemoteServers::bindWanted() {
  record_->bindings.store(wanted_.size(), std::memory_order_relaxed);
  if (!connection_) return;
  for (auto& [name, wanted] : wanted_) {
    if (wanted.binding == 0 && Clock::nowNs() >= wanted.bindAgainNs) bind(name, wanted);
  }
}

void RemoteServers::bind(const ServerName& name, Wanted& wanted) {
  wanted.binding = ++lastBinding_;
  bindings_[wanted.binding] = name;
  connection_->line().send([binding = wanted.binding, name](wire::Item::Builder item) {
    auto bind = item.initBind();
    bind.setBinding(binding);
    bind.setLocation(name.location);
    bind.setServer(name.server);
  });
}

void RemoteServers::unbind(const Wanted& wanted) {
  if (connection_ && wanted.binding != 0)
    connection_->line().send(
        [binding = wanted.binding](wire::Item::Builder item) { item.setUnbind(binding); });
  bindings_.erase(wanted.binding);
}

void RemoteServers::onServer(wire::Server::Reader server) {
  const auto binding = bindings_.find(server.getBinding());
  if (binding == bindings_.end()) return;  // it was unbound while this item was on its way
  const auto name = binding->second;
  auto& wanted = wanted_.at(name);
  switch (server.getState()) {
    case wire::Server::State::THERE:
      wanted.offer = Proxy::Offer{server.getBinding(), server.getIncarnation(), queueSizeOf(server),
                                  server.getMaxMessageBytes(), server.getHops()};
      if (wanted.proxy) wanted.proxy->drain(Fate::neverTaken);  // it was for an earlier incarnation
      break;
    case wire::Server::State::REFUSED:
      onRefusal(name, wanted, displayText(server.getReason()));
      bindings_.erase(binding);
      wanted.offer.reset();
      if (wanted.proxy) wanted.proxy->drain(Fate::outcomeUnknown);
      break;
    case wire::Server::State::ABSENT:  // every request taken there has ended
      wanted.offer.reset();
      if (wanted.proxy) wanted.proxy->drain(Fate::neverTaken);
      break;
    default:  // a state that only a newer peer defines
      wanted.offer.reset();
      if (wanted.proxy) wanted.proxy->drain(Fate::outcomeUnknown);
      break;
  }
  updateProxy(name, wanted);
  if (isPending(wanted)) sweepSoon();
}

// Binds again after a while, since the configuration of the peer may change.
void RemoteServers::onRefusal(const ServerName& name, Wanted& wanted, const std::string& why) {
  if (wanted.problem != why)
    log_.warn("{} at location {}: {} refused the bind: {}", name.server, name.location,
              remote_.address.text(), why);
  wanted.problem = why;
  wanted.binding = 0;
  wanted.bindAgainNs = Clock::nowNs() + kBindAgainNs;
}

void RemoteServers::makeProxy(const ServerName& name, Wanted& wanted) try {
  if (!wanted.offer) return;
  // If the name is in use, the constructor of a server waits for a while. Here, the next sweep()
  // tries again.
  checkNameIsFree(SegmentName::serverWindow(context_.backplane.name(), name.location, name.server));
  wanted.proxy = std::make_unique<Proxy>(context_, *connection_, name, *wanted.offer);
  wanted.offer.reset();
  wanted.problem.clear();
  log_.info("{} at location {} is available", name.server, name.location);
} catch (const std::exception& error) {
  if (wanted.problem != error.what())
    log_.warn("{} at location {} cannot be offered here: {}", name.server, name.location,
              error.what());
  wanted.problem = error.what();
}

// Keeps the pools of the proxy for a while instead of waiting for its clients, as the destructor of
// a server does: one that is stopped would delay all traffic of the router.
void RemoteServers::endProxy(Wanted& wanted) {
  if (!wanted.proxy) return;
  auto pools = wanted.proxy->closeAll();
  wanted.proxy.reset();
  if (!pools) return;
  ending_.add(context_.timer.afterDelay(kReceiveTime).then([pools = std::move(pools)] {}));
}

// Makes proxies for new offers, destroys those that are done, and forgets the servers that have
// been idle for kIdleProxyNs.
void RemoteServers::sweep() {
  for (auto each = wanted_.begin(); each != wanted_.end();) {
    auto& [name, wanted] = *each;
    updateProxy(name, wanted);
    if (wanted.idleSinceNs == 0 || Clock::nowNs() - wanted.idleSinceNs < kIdleProxyNs) {
      ++each;
      continue;
    }
    unbind(wanted);
    endProxy(wanted);
    each = wanted_.erase(each);
  }
  bindWanted();
  if (std::ranges::any_of(wanted_, [this](const auto& each) { return isPending(each.second); }))
    sweepSoon();
}

void RemoteServers::updateProxy(const ServerName& name, Wanted& wanted) {
  if (wanted.proxy && wanted.proxy->isDone()) {
    log_.info("{} at location {} is no longer available", name.server, name.location);
    endProxy(wanted);
  }
  if (!wanted.proxy && wanted.offer && connection_) makeProxy(name, wanted);
  if (wanted.proxy && wanted.proxy->hasClients()) wanted.idleSinceNs = 0;
  else if (wanted.proxy && wanted.idleSinceNs == 0) wanted.idleSinceNs = Clock::nowNs();
}

// Whether a later sweep may have something to do even if no event occurs before it.
bool RemoteServers::isPending(const Wanted& wanted) const {
  return wanted.idleSinceNs != 0 || (wanted.binding == 0 && connection_) ||
         (wanted.offer && !wanted.proxy) || (wanted.proxy && wanted.proxy->isDraining());
}

void RemoteServers::sweepSoon() { sweeps_.setAt(Deadline::after(kSweepEvery)); }

// ---- requests and replies

// Takes up to kTurn requests of each server in turn, beginning after pumped_, so that a flood of
// requests to one server does not delay requests to the others.
void RemoteServers::pump() {
  if (!connection_) return;
  auto next = wanted_.upper_bound(pumped_);
  const ServerName* pumped = nullptr;
  std::size_t idle = 0;
  for (int turns = 0; turns < kMaxTurns && idle < wanted_.size() && connection_->line().hasRoom();
       ++next) {
    if (next == wanted_.end()) next = wanted_.begin();
    ++idle;
    auto& proxy = next->second.proxy;
    if (!proxy || !proxy->hasMore()) continue;
    ++turns;
    pumped = &next->first;
    if (proxy->pump(kTurn)) idle = 0;
  }
  if (pumped != nullptr) pumped_ = *pumped;
  if (idle < wanted_.size() && connection_->line().hasRoom())
    pumpAgain_.setAt(Deadline::after(Nanoseconds(0)));
}

void RemoteServers::refuse(const Carried& request, const std::string& why) {
  log_.warn("a request cannot be sent to {} and is refused: {}", remote_.address.text(), why);
  if (!connection_) return;
  if (auto* proxy = connection_->proxyOf(request.client))
    proxy->endRequest(request.client, request.requestId, Fate::refused, why);
}

void RemoteServers::handle(wire::Item::Reader item) {
  switch (item.which()) {
    case wire::Item::SERVER:
      return onServer(item.getServer());
    case wire::Item::REPLY:
      if (auto* proxy = connection_->openedProxyOf(item.getReply().getClient())) {
        proxy->reply(item.getReply().getClient(), item.getReply());
        if (proxy->isDone()) sweep();
      }
      return;
    case wire::Item::FATE:
      return onFate(item.getFate());
    case wire::Item::QUEUE_FULL:
      if (auto* proxy = connection_->openedProxyOf(item.getQueueFull()))
        proxy->queueFull(item.getQueueFull());
      return;
    case wire::Item::REFUSE:
      if (auto* proxy = connection_->openedProxyOf(item.getRefuse().getClient()))
        proxy->refuse(item.getRefuse().getClient(), displayText(item.getRefuse().getReason()));
      return;
    case wire::Item::BIND:
    case wire::Item::UNBIND:
    case wire::Item::OPEN:
    case wire::Item::CLOSE:
    case wire::Item::REQUEST:
    case wire::Item::CREDIT:
      rejectClientRouterItem();
    default:  // an item that only a newer peer defines
      return;
  }
}

void RemoteServers::handle(PlainItem& item) { handlePlain(item); }
void RemoteServers::handle(const PlainItems& items) { handlePlain(items); }

template <class Items>
void RemoteServers::handlePlain(Items& items) {
  if (items.isRequest) rejectClientRouterItem();
  auto* proxy = connection_->openedProxyOf(items.client);
  if (proxy == nullptr) return;
  proxy->reply(items);
  if (proxy->isDone()) sweep();
}

void RemoteServers::onFate(wire::RequestEnd::Reader fate) {
  auto* proxy = connection_->openedProxyOf(fate.getClient());
  if (proxy == nullptr) return;
  proxy->endRequest(fate.getClient(), fate.getRequestId(), fateOf(fate.getFate()),
                    displayText(fate.getReason()));
  if (proxy->isDone()) sweep();
}

}  // namespace mpf::router
