// SPDX-License-Identifier: MIT
#include "router/incoming/local_servers.h"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <utility>
#include <vector>

#include "router/config/access.h"
#include "router/transport/kj_text.h"
#include "shm/link.h"
#include "shm/segment_name.h"

namespace mpf::router {
namespace {

constexpr std::size_t kMaxBindings = 4096;  // per connection
constexpr std::chrono::seconds kLookEvery{1};

[[noreturn]] void rejectServerRouterItem() {
  throw ProtocolError(FarewellCode::PROTOCOL, "received an item that only a server router sends");
}

bool isServerName(kj::StringPtr text) try {
  SegmentName::checkServer({text.begin(), text.size()});
  return true;
} catch (const std::invalid_argument&) {
  return false;
}

}  // namespace

LocalServers::LocalServers(RouterContext& context, Line& line, PeerRecord& record, std::string peer,
                           std::string address)
    : context_(context),
      line_(line),
      record_(record),
      peer_(std::move(peer)),
      address_(std::move(address)),
      clients_(
          context, line, record,
          FarClient::Events{
              .onConnected = [this](FarClient& client) { onConnected(client); },
              .onDisconnected = [this](FarClient& client) { onDisconnected(client); },
              .onRefused = [this](FarClient& client,
                                  const std::string& why) { refuseClient(client.number(), why); },
          }),
      looks_(context.timer, [this] { lookAtDoubtful(); }) {}

void LocalServers::handle(wire::Item::Reader item) {
  switch (item.which()) {
    case wire::Item::BIND:
      return onBind(item.getBind());
    case wire::Item::UNBIND:
      return onUnbind(item.getUnbind());
    case wire::Item::OPEN:
      return onOpen(item.getOpen());
    case wire::Item::CLOSE:
      return onClose(item.getClose());
    case wire::Item::REQUEST:
      return onRequest(item.getRequest());
    case wire::Item::CREDIT:
      if (auto* client = clients_.find(item.getCredit().getClient()))
        client->credit(item.getCredit().getBytes());
      return;
    case wire::Item::SERVER:
    case wire::Item::REFUSE:
    case wire::Item::REPLY:
    case wire::Item::FATE:
    case wire::Item::QUEUE_FULL:
      rejectServerRouterItem();
    default:  // an item that only a newer peer defines
      return;
  }
}

void LocalServers::handle(PlainItem& item) {
  if (!item.isRequest) rejectServerRouterItem();
  if (auto* client = clients_.find(item.client)) client->request(item);
  else endWithoutClient(item.client, item.requestId);
}

void LocalServers::handle(const PlainItems& items) {
  if (!items.isRequest) rejectServerRouterItem();
  if (auto* client = clients_.find(items.client)) return client->request(items);
  for (std::size_t at = 0; at < items.run.size(); ++at)
    endWithoutClient(items.client, items.run[at].requestId());
}

// ---- bindings

void LocalServers::onBind(wire::Bind::Reader bind) {
  const auto number = bind.getBinding();
  if (bindings_.contains(number))
    throw ProtocolError(FarewellCode::PROTOCOL, fmt::format("binding {} is open already", number));
  if (bindings_.size() >= kMaxBindings)
    return refuseBind(number, fmt::format("more than {} bindings", kMaxBindings));
  if (!isServerName(bind.getServer()))
    return refuseBind(
        number, fmt::format("\"{}\" is not a valid server name", displayText(bind.getServer())));
  const ServerName name{bind.getLocation(), toStd(bind.getServer())};
  const auto* serve = findAllowed(context_.config, peer_, name.location, name.server);
  if (serve == nullptr)
    return refuseBind(number, fmt::format("server {} at location {} is not allowed for this peer",
                                          name.server, name.location));
  const auto monitor = context_.monitors.of({serve->local, name.server});
  Binding made{.number = number, .name = name, .local = serve->local, .monitor = monitor};
  auto& binding = bindings_.try_emplace(number, std::move(made)).first->second;
  countBindings();
  look(binding);
  if (binding.state == Binding::State::absent) sendAbsent(binding);
}

void LocalServers::onUnbind(std::uint32_t number) {
  clients_.removeAllOf(number);
  bindings_.erase(number);
  countBindings();
}

void LocalServers::countBindings() noexcept {
  record_->bindings.store(bindings_.size(), std::memory_order_relaxed);
}

void LocalServers::refuseBind(std::uint32_t number, const std::string& why) {
  context_.log.warn("{}: {}", address_, why);
  line_.send([number, why](wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(number);
    server.setState(wire::Server::State::REFUSED);
    server.setReason(displayText(why));
  });
}

void LocalServers::onConfig() {
  std::vector<std::uint32_t> gone;
  for (const auto& [number, binding] : bindings_) {
    const auto& name = binding.name;
    const auto* serve = findAllowed(context_.config, peer_, name.location, name.server);
    if (serve == nullptr || serve->local != binding.local) gone.push_back(number);
  }
  for (const auto number : gone) {
    onUnbind(number);
    refuseBind(number, "the configuration has changed");
  }
}

// ---- the servers of the bindings

void LocalServers::onServers() {
  if (!bindings_.empty()) lookSoon();
  for (auto& [number, binding] : bindings_) update(binding);
}

void LocalServers::look(Binding& binding) {
  lookSoon();
  binding.monitor->look();
  update(binding);
}

// Announces what the last look() of the monitor has found.
void LocalServers::update(Binding& binding) {
  const bool isThere = binding.monitor->isThere();
  logFailure(binding, !isThere && binding.monitor->isDoubtful());
  if (isThere && binding.announced == binding.monitor->incarnation()) return;
  if (binding.state == Binding::State::there) beginEnd(binding);
  if (binding.state == Binding::State::ending) return endIfDone(binding);
  if (isThere) sendThere(binding);
}

void LocalServers::logFailure(Binding& binding, bool hasFailed) {
  if (hasFailed && !binding.failureLogged) {
    context_.log.warn("{} at location {} cannot be offered to {}: {}", binding.name.server,
                      binding.name.location, address_, binding.monitor->problem());
  }
  binding.failureLogged = hasFailed;
}

// Looks again at servers that may have changed without a notification: the last look failed, or the
// server has closed its window while its process continues. The connected clients of a server would
// notice that it has closed; while it has none, this check is repeated.
void LocalServers::lookAtDoubtful() {
  for (auto& [number, binding] : bindings_) {
    if (binding.monitor->isDoubtful()) look(binding);
    else if (binding.state != Binding::State::absent && binding.connected == 0) lookSoon();
  }
}

void LocalServers::lookSoon() { looks_.setAt(Deadline::after(kLookEvery)); }

// The server is gone. Its clients receive what it had sent, and are then disconnected.
void LocalServers::beginEnd(Binding& binding) {
  binding.state = Binding::State::ending;
  clients_.forEachOf(binding.number, [](FarClient& client) {
    if (client.isConnected()) client.onServerGone();
    else client.giveUp(Fate::neverTaken, "the server is gone");
  });
}

// Sends "absent" when all clients of the server are disconnected: all their requests have ended.
void LocalServers::endIfDone(Binding& binding) {
  if (binding.connected != 0) return;
  clients_.dropAllOf(binding.number);
  binding.state = Binding::State::absent;
  binding.announced = 0;
  sendAbsent(binding);
  if (binding.monitor->look()) sendThere(binding);
}

void LocalServers::sendThere(Binding& binding) {
  binding.state = Binding::State::there;
  binding.announced = binding.monitor->incarnation();
  const auto queueSize = binding.queueSize = binding.monitor->queueSize();
  const auto maxBodyBytes = std::max(binding.monitor->maxMessageBytes(), kMaxHeaderBytes);
  line_.send([number = binding.number, queueSize, incarnation = binding.announced,
              hops = binding.monitor->hops(),
              maxMessageBytes = std::min(maxBodyBytes - kMaxHeaderBytes, line_.maxMessageBytes())](
                 wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(number);
    server.setState(wire::Server::State::THERE);
    server.setIncarnation(incarnation);
    server.setQueueSize(queueSize);
    server.setMaxOutstanding(LinkGeometry::forQueue(queueSize).maxOutstanding);
    server.setMaxMessageBytes(maxMessageBytes);
    server.setHops(static_cast<std::uint16_t>(hops));  // less than kMaxHops
  });
}

void LocalServers::sendAbsent(const Binding& binding) {
  line_.send([number = binding.number, why = binding.monitor->problem()](wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(number);
    server.setState(wire::Server::State::ABSENT);
    server.setReason(displayText(why));
  });
}

// ---- clients

void LocalServers::onOpen(wire::Open::Reader open) {
  const auto number = open.getClient();
  clients_.open(number);
  if (open.getWindow() == 0)
    throw ProtocolError(FarewellCode::PROTOCOL,
                        fmt::format("client {} has a window of 0 bytes", number));
  const auto found = bindings_.find(open.getBinding());
  if (found == bindings_.end()) return;
  const auto& binding = found->second;
  // If the server ended while this item was on its way, no client is created: its requests end as
  // neverTaken.
  if (binding.state != Binding::State::there || binding.announced != open.getIncarnation()) return;
  try {
    clients_.add(
        {number, open.getBinding(), open.getIncarnation(), binding.queueSize, open.getWindow()},
        {binding.local, binding.name.server});
  } catch (const std::exception& error) {  // no memory or no file descriptor is left
    refuseClient(number, error.what());
  }
}

void LocalServers::refuseClient(std::uint32_t number, const std::string& why) {
  context_.log.warn("{}: a client is refused: {}", address_, why);
  line_.send([number, why](wire::Item::Builder item) {
    auto refusal = item.initRefuse();
    refusal.setClient(number);
    refusal.setReason(displayText(why));
  });
}

void LocalServers::onRequest(wire::Request::Reader request) {
  const auto number = request.getClient();
  if (auto* client = clients_.find(number)) return client->request(request);
  endWithoutClient(number, request.getRequestId());
}

void LocalServers::endWithoutClient(std::uint32_t client, std::uint32_t requestId) {
  line_.send([client, requestId](wire::Item::Builder answer) {
    auto end = answer.initFate();
    end.setClient(client);
    end.setRequestId(requestId);
    end.setFate(wire::Fate::NEVER_TAKEN);
    end.setReason("the server is gone");
  });
}

void LocalServers::onClose(std::uint32_t number) {
  const auto* client = clients_.tryFind(number);
  if (client == nullptr) return;
  const bool wasConnected = client->isConnected();
  auto* const binding = bindingOf(*client);
  clients_.remove(number);
  if (binding == nullptr) return;
  if (wasConnected) --binding->connected;
  lookSoon();
  if (binding->state == Binding::State::ending) endIfDone(*binding);
}

LocalServers::Binding* LocalServers::bindingOf(const FarClient& client) {
  const auto binding = bindings_.find(client.binding());
  return binding == bindings_.end() ? nullptr : &binding->second;
}

void LocalServers::onConnected(FarClient& client) {
  if (auto* binding = bindingOf(client)) ++binding->connected;
}

// Called from the callback of that client.
void LocalServers::onDisconnected(FarClient& client) {
  auto* const binding = bindingOf(client);
  if (binding == nullptr) return;
  --binding->connected;
  if (binding->state != Binding::State::ending) return look(*binding);
  client.giveUp(Fate::neverTaken, "the server is gone");
  endIfDone(*binding);
}

void LocalServers::loseReply(const Carried& reply, const std::string& why,
                             wire::Item::Builder instead) {
  context_.log.warn("a reply to {} cannot be sent and is lost: {}", address_, why);
  // The peer gives no credit for a reply that it does not receive.
  if (auto* client = clients_.tryFind(reply.client)) client->credit(windowBytesOf(reply.message));
  if (!reply.isFirst) return;
  auto end = instead.initFate();
  end.setClient(reply.client);
  end.setRequestId(reply.requestId);
  end.setFate(wire::Fate::OUTCOME_UNKNOWN);
  end.setReason(displayText(why));
}

}  // namespace mpf::router
