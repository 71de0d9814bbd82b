// SPDX-License-Identifier: MIT
#include "router/incoming/server_router.h"

#include <algorithm>
#include <fmt/format.h>

#include "router/transport/kj_text.h"
#include "shm/link.h"
#include "shm/segment_name.h"

namespace mpf::router {
namespace {

// Batches of messages that the dispatcher runs between two looks at the line and the clock.
constexpr int kBatches = 8;
// The time for the dispatcher before the event loop runs its other tasks.
constexpr std::chrono::milliseconds kDispatcherTurn{1};
constexpr std::size_t kMaxBindings = 4096;  // per connection
constexpr std::chrono::seconds kLookEvery{1};

bool isServerName(kj::StringPtr text) try {
  SegmentName::checkServer({text.begin(), text.size()});
  return true;
} catch (const std::invalid_argument&) {
  return false;
}

}  // namespace

ServerRouter::ServerRouter(RouterContext& context, kj::Own<kj::AsyncIoStream> stream,
                           std::string peer, const std::string& address, bool isTls)
    : context_(context),
      peer_(std::move(peer)),
      address_(address),
      record_(context.statistics.add(layout::RouterRole::server)),
      timer_(context.timer, [this] { runDispatcher(); }),
      looks_(context.timer, [this] { lookAtDoubtful(); }) {
  record_->setAddress(address);
  record_->setState(layout::RouterLineState::connecting);
  (*record_)->isTls.store(isTls ? 1 : 0, std::memory_order_relaxed);
  noteLocations();
  line_ =
      std::make_unique<Line>(kj::mv(stream), context.timer, context.config.limits, *record_, *this);
}

kj::Promise<void> ServerRouter::run() {
  return line_
      ->run([this](wire::Item::Builder item) {
        auto greeting = item.initGreeting();
        fillGreeting(greeting, context_);
        const auto& serve = context_.config.serve;
        auto locations = greeting.initLocations(static_cast<capnp::uint>(serve.size()));
        for (capnp::uint at = 0; at < locations.size(); ++at) locations.set(at, serve[at].location);
        greeting.setMaxClients(line_->limits().maxClients);
      })
      .then([this](const LineEnd& end) {
        context_.log.info("{} at {} disconnected: {}",
                          line_->peer().router.empty() ? "a peer" : line_->peer().router, address_,
                          end.text);
      });
}

void ServerRouter::noteLocations() {
  std::vector<std::int32_t> locations;
  locations.reserve(context_.config.serve.size());
  for (const auto& serve : context_.config.serve) locations.push_back(serve.location);
  record_->setLocations(locations);
}

void ServerRouter::stop() { line_->end(FarewellCode::STOPPING, "the router is stopping"); }

void ServerRouter::onGreeting(const PeerGreeting& greeting) {
  count((*record_)->connects);
  record_->setState(layout::RouterLineState::connected);
  context_.log.info("{} at {} is connected ({}{}{})", greeting.router, address_, greeting.program,
                    peer_.empty() ? "" : ", certificate of ", peer_);
}

// ---- servers

const Serve* ServerRouter::served(const ServerName& name) const {
  const auto& config = context_.config;
  const auto serve = std::ranges::find(config.serve, name.location, &Serve::location);
  if (serve == config.serve.end()) return nullptr;
  const auto allows = [&](const Allow& allow) {
    const auto matchesServer = [&](const std::string& pattern) {
      return matches(pattern, name.server);
    };
    return matches(allow.peer, peer_) &&
           (allow.locations.empty() ||
            std::ranges::find(allow.locations, name.location) != allow.locations.end()) &&
           std::ranges::any_of(allow.servers, matchesServer);
  };
  return config.allow.empty() || std::ranges::any_of(config.allow, allows) ? &*serve : nullptr;
}

void ServerRouter::onBind(wire::Bind::Reader bind) {
  const auto number = bind.getBinding();
  if (bindings_.contains(number))
    throw ProtocolError(FarewellCode::PROTOCOL, fmt::format("binding {} is open already", number));
  if (bindings_.size() >= kMaxBindings)
    return refuse(number, fmt::format("more than {} bindings", kMaxBindings));
  if (!isServerName(bind.getServer()))
    return refuse(number,
                  fmt::format("\"{}\" is not a valid server name", displayText(bind.getServer())));
  const ServerName name{bind.getLocation(), toStd(bind.getServer())};
  const auto* serve = served(name);
  if (serve == nullptr)
    return refuse(number, fmt::format("server {} at location {} is not allowed for this peer",
                                      name.server, name.location));
  auto& binding =
      bindings_.try_emplace(number, name, context_.monitors, serve->local).first->second;
  countAll();
  look(number, binding);
  if (binding.announced == 0) sendAbsent(number, binding);
}

void ServerRouter::onUnbind(std::uint32_t number) {
  std::erase_if(clients_, [&](const auto& each) { return each.second->binding() == number; });
  bindings_.erase(number);
  countAll();
}

void ServerRouter::countAll() {
  (*record_)->bindings.store(bindings_.size(), std::memory_order_relaxed);
  (*record_)->clients.store(clients_.size(), std::memory_order_relaxed);
}

void ServerRouter::refuse(std::uint32_t number, const std::string& why) {
  context_.log.warn("{}: {}", address_, why);
  line_->send([number, why](wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(number);
    server.setState(wire::Server::State::REFUSED);
    server.setReason(displayText(why));
  });
}

void ServerRouter::refuseClient(std::uint32_t number, const std::string& why) {
  context_.log.warn("{}: a client is refused: {}", address_, why);
  line_->send([number, why](wire::Item::Builder item) {
    auto refusal = item.initRefuse();
    refusal.setClient(number);
    refusal.setReason(displayText(why));
  });
}

void ServerRouter::lookAtAll() {
  for (auto& [number, binding] : bindings_) look(number, binding);
}

void ServerRouter::look(std::uint32_t number, Binding& binding) {
  lookSoon();
  const bool isThere = binding.monitor->look();
  const bool hasFailed = !isThere && binding.monitor->isDoubtful();
  if (hasFailed && !binding.failureLogged) {
    context_.log.warn("{} at location {} cannot be offered to {}: {}", binding.name.server,
                      binding.name.location, address_, binding.monitor->problem());
  }
  binding.failureLogged = hasFailed;
  if (isThere && binding.announced == binding.monitor->incarnation()) return;
  if (binding.announced != 0 && !binding.isEnding) {
    binding.isEnding = true;
    for (auto& [clientNumber, client] : clients_) {
      if (client->binding() != number) continue;
      if (client->isConnected()) client->onServerGone();
      else client->giveUp(Fate::neverTaken, "the server is gone");
    }
  }
  if (binding.isEnding) return endIfDone(number, binding);
  if (isThere) sendThere(number, binding);
}

// Looks again at servers that may have changed without a notification: the last look failed, or the
// server has closed its window while its process continues. The connected clients of a server would
// notice that it has closed; while it has none, this check is repeated.
void ServerRouter::lookAtDoubtful() {
  for (auto& [number, binding] : bindings_) {
    if (binding.monitor->isDoubtful()) look(number, binding);
    else if (binding.announced != 0 && binding.connected == 0) lookSoon();
  }
}

void ServerRouter::lookSoon() { looks_.setAt(Deadline::after(kLookEvery)); }

// Sends "absent" when all clients of the server are disconnected: all their requests have ended.
void ServerRouter::endIfDone(std::uint32_t number, Binding& binding) {
  if (binding.connected != 0) return;
  for (auto each = clients_.begin(); each != clients_.end();) {
    if (each->second->binding() != number) {
      ++each;
      continue;
    }
    dropped_.push_back(std::move(each->second));
    each = clients_.erase(each);
  }
  countAll();
  binding.isEnding = false;
  binding.announced = 0;
  sendAbsent(number, binding);
  if (binding.monitor->look()) sendThere(number, binding);
}

void ServerRouter::sendThere(std::uint32_t number, Binding& binding) {
  binding.announced = binding.monitor->incarnation();
  const auto queueSize = binding.queueSize = binding.monitor->queueSize();
  const auto maxBodyBytes = std::max(binding.monitor->maxMessageBytes(), kMostBesideElements);
  line_->send([number, queueSize, incarnation = binding.announced,
               maxMessageBytes = std::min(maxBodyBytes - kMostBesideElements,
                                          line_->maxMessageBytes())](wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(number);
    server.setState(wire::Server::State::THERE);
    server.setIncarnation(incarnation);
    server.setQueueSize(queueSize);
    server.setMaxOutstanding(LinkGeometry::forQueue(queueSize).maxOutstanding);
    server.setMaxMessageBytes(maxMessageBytes);
  });
}

void ServerRouter::sendAbsent(std::uint32_t number, Binding& binding) {
  line_->send([number, why = binding.monitor->problem()](wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(number);
    server.setState(wire::Server::State::ABSENT);
    server.setReason(displayText(why));
  });
}

void ServerRouter::onConfig() {
  noteLocations();
  std::vector<std::uint32_t> gone;
  for (const auto& [number, binding] : bindings_) {
    const auto* serve = served(binding.name);
    if (serve == nullptr || serve->local != binding.local) gone.push_back(number);
  }
  for (const auto number : gone) {
    onUnbind(number);
    refuse(number, "the configuration has changed");
  }
}

// ---- clients

void ServerRouter::onOpen(wire::Open::Reader open) {
  const auto number = open.getClient();
  if (number == 0 || number <= lastClient_)
    throw ProtocolError(
        FarewellCode::PROTOCOL,
        fmt::format("client number {} is not greater than the last one, {}", number, lastClient_));
  if (clients_.size() >= line_->limits().maxClients) {
    throw ProtocolError(FarewellCode::LIMIT,
                        fmt::format("more than {} clients", line_->limits().maxClients));
  }
  lastClient_ = number;
  const auto binding = bindings_.find(open.getBinding());
  // If the server ended while this item was on its way, no client is created: its requests end as
  // neverTaken.
  const bool isCurrent = binding != bindings_.end() && binding->second.announced != 0 &&
                         binding->second.announced == open.getIncarnation();
  if (!isCurrent || binding->second.isEnding) return;
  try {
    addClient(open, binding->second);
  } catch (const std::exception& error) {  // no memory or no file descriptor is left
    refuseClient(number, error.what());
  }
}

void ServerRouter::addClient(wire::Open::Reader open, Binding& binding) {
  const auto number = open.getClient();
  if (!dispatcher_) {
    dispatcher_ = std::make_unique<Dispatcher>(
        context_.backplane, DispatcherOptions{WaitMode::block, "router " + line_->peer().router});
    readable_ = std::make_unique<Readable>(context_.port, dispatcher_->descriptor(),
                                           [this] { runDispatcher(); });
  }
  auto client =
      std::make_unique<FarClient>(context_, *this, *dispatcher_,
                                  FarClient::Terms{number, open.getBinding(), open.getIncarnation(),
                                                   binding.queueSize, open.getWindow()});
  client->bind(binding.name.server, binding.local);
  clients_[number] = std::move(client);
  countAll();
  scheduleTimer();
}

void ServerRouter::onClose(std::uint32_t client) {
  const auto found = clients_.find(client);
  if (found == clients_.end()) return;
  const auto number = found->second->binding();
  const bool wasConnected = found->second->isConnected();
  clients_.erase(found);
  countAll();
  const auto binding = bindings_.find(number);
  if (binding == bindings_.end()) return;
  if (wasConnected) --binding->second.connected;
  lookSoon();
  if (binding->second.isEnding) endIfDone(number, binding->second);
}

void ServerRouter::onConnected(FarClient& client) {
  if (const auto binding = bindings_.find(client.binding()); binding != bindings_.end())
    ++binding->second.connected;
}

// Called from the callback of that client.
void ServerRouter::onDisconnected(FarClient& client) {
  const auto binding = bindings_.find(client.binding());
  if (binding == bindings_.end()) return;
  --binding->second.connected;
  if (binding->second.isEnding) {
    client.giveUp(Fate::neverTaken, "the server is gone");
    return endIfDone(client.binding(), binding->second);
  }
  look(client.binding(), binding->second);
}

void ServerRouter::runDispatcher() {
  if (!line_->hasRoom()) return;
  const auto end = Deadline::after(kDispatcherTurn);
  bool isDrained = false;
  while (!isDrained && !end.hasPassed() && line_->hasRoom())
    isDrained = dispatcher_->runPending(kBatches);
  dropped_.clear();
  if (!isDrained && line_->hasRoom()) return timer_.setAt(Deadline::after(Nanoseconds(0)));
  scheduleTimer();
}

// Runs the dispatcher also when one of its deadlines is due.
void ServerRouter::scheduleTimer() { timer_.setAt(dispatcher_->nextDeadline()); }

// ---- from the line

void ServerRouter::onItem(wire::Item::Reader item) {
  const auto clientOf = [&](std::uint32_t number) {
    if (number > lastClient_ || number == 0)
      throw ProtocolError(FarewellCode::PROTOCOL,
                          fmt::format("client {} was never opened", number));
    const auto found = clients_.find(number);
    return found == clients_.end() ? nullptr : found->second.get();
  };
  switch (item.which()) {
    case wire::Item::BIND:
      return onBind(item.getBind());
    case wire::Item::UNBIND:
      return onUnbind(item.getUnbind());
    case wire::Item::OPEN:
      return onOpen(item.getOpen());
    case wire::Item::CLOSE:
      return onClose(item.getClose());
    case wire::Item::REQUEST: {
      const auto request = item.getRequest();
      if (auto* client = clientOf(request.getClient())) return client->request(request);
      return line_->send(
          [number = request.getClient(), id = request.getRequestId()](wire::Item::Builder answer) {
            auto end = answer.initFate();
            end.setClient(number);
            end.setRequestId(id);
            end.setFate(wire::Fate::NEVER_TAKEN);
            end.setReason("the server is gone");
          });
    }
    case wire::Item::CREDIT:
      if (auto* client = clientOf(item.getCredit().getClient()))
        client->credit(item.getCredit().getBytes());
      return;
    case wire::Item::SERVER:
    case wire::Item::REFUSE:
    case wire::Item::REPLY:
    case wire::Item::FATE:
    case wire::Item::QUEUE_FULL:
      throw ProtocolError(FarewellCode::PROTOCOL, "an item that only a server router sends");
    default:  // an item that only a newer peer defines
      return;
  }
}

void ServerRouter::onRoom() {
  if (dispatcher_) runDispatcher();
}

// The server has handled the request, but its reply cannot be sent.
void ServerRouter::onUnsendable(const Carried& carried, const std::string& why,
                                wire::Item::Builder instead) {
  context_.log.warn("a reply to {} cannot be sent and is lost: {}", address_, why);
  // The peer gives no credit for a reply that it does not receive.
  if (const auto client = clients_.find(carried.client); client != clients_.end())
    client->second->credit(windowBytesOf(carried.message));
  if (!carried.isFirst) return;
  auto end = instead.initFate();
  end.setClient(carried.client);
  end.setRequestId(carried.requestId);
  end.setFate(wire::Fate::OUTCOME_UNKNOWN);
  end.setReason(displayText(why));
}

}  // namespace mpf::router
