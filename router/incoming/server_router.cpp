// SPDX-License-Identifier: MIT
#include "router/incoming/server_router.h"

#include <algorithm>
#include <fmt/format.h>

#include "router/transport/kj_text.h"
#include "shm/link.h"
#include "shm/segment_name.h"

namespace mpf::router {
namespace {

// of messages of the dispatcher, between looks at the line and the clock
constexpr int kBatches = 8;
// before everything else that the loop has to do
constexpr std::chrono::milliseconds kWithClients{1};
constexpr std::size_t kMaxBindings = 4096;  // of one connection
constexpr std::chrono::seconds kLookEvery{1};

bool isServerName(kj::StringPtr text) try {
  SegmentName::checkServer({text.begin(), text.size()});
  return true;
} catch (const std::invalid_argument&) {
  return false;
}

}  // namespace

ServerRouter::ServerRouter(Surroundings& here, kj::Own<kj::AsyncIoStream> stream, std::string peer,
                           const std::string& address, bool isTls)
    : here_(here),
      peer_(std::move(peer)),
      address_(address),
      record_(here.statistics.add(layout::RouterRole::server)),
      timer_(here.timer, [this] { runDispatcher(); }),
      looks_(here.timer, [this] { lookAtDoubtful(); }) {
  record_->setAddress(address);
  record_->setState(layout::RouterLineState::connecting);
  (*record_)->isTls.store(isTls ? 1 : 0, std::memory_order_relaxed);
  noteLocations();
  line_ = std::make_unique<Line>(kj::mv(stream), here.timer, here.config.limits, *record_, *this);
}

kj::Promise<void> ServerRouter::run() {
  return line_
      ->run([this](wire::Item::Builder item) {
        auto greeting = item.initGreeting();
        introduce(greeting, here_);
        const auto& serve = here_.config.serve;
        auto locations = greeting.initLocations(static_cast<capnp::uint>(serve.size()));
        for (capnp::uint at = 0; at < locations.size(); ++at) locations.set(at, serve[at].location);
        greeting.setMaxClients(line_->limits().maxClients);
      })
      .then([this](const LineEnd& end) {
        here_.log.info("{} at {} is gone: {}",
                       line_->peer().router.empty() ? "a peer" : line_->peer().router, address_,
                       end.text);
      });
}

void ServerRouter::noteLocations() {
  std::vector<std::int32_t> locations;
  locations.reserve(here_.config.serve.size());
  for (const auto& serve : here_.config.serve) locations.push_back(serve.location);
  record_->setLocations(locations);
}

void ServerRouter::stop() { line_->end(FarewellCode::STOPPING, "the router ends"); }

void ServerRouter::onGreeting(const PeerGreeting& greeting) {
  count((*record_)->connects);
  record_->setState(layout::RouterLineState::connected);
  here_.log.info("{} at {} is connected ({}{}{})", greeting.router, address_, greeting.program,
                 peer_.empty() ? "" : ", certificate of ", peer_);
}

// ---- servers

const Serve* ServerRouter::served(const ServerName& name) const {
  const auto& config = here_.config;
  const auto serve = std::ranges::find(config.serve, name.location, &Serve::location);
  if (serve == config.serve.end()) return nullptr;
  const auto allows = [&](const Allow& allow) {
    const auto fitsServer = [&](const std::string& pattern) { return fits(pattern, name.server); };
    return fits(allow.peer, peer_) &&
           (allow.locations.empty() ||
            std::ranges::find(allow.locations, name.location) != allow.locations.end()) &&
           std::ranges::any_of(allow.servers, fitsServer);
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
    return refuse(
        number, fmt::format("\"{}\" is not a valid name of a server", forPeople(bind.getServer())));
  const ServerName name{bind.getLocation(), toStd(bind.getServer())};
  const auto* serve = served(name);
  if (serve == nullptr)
    return refuse(number, fmt::format("server {} at location {} is not for this peer", name.server,
                                      name.location));
  auto& binding = bindings_.try_emplace(number, name, here_.presences, serve->local).first->second;
  countAll();
  look(number, binding);
  if (binding.told == 0) tellAbsent(number, binding);
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
  here_.log.warn("{}: {}", address_, why);
  line_->send([number, why](wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(number);
    server.setState(wire::Server::State::REFUSED);
    server.setReason(forPeople(why));
  });
}

void ServerRouter::refuseClient(std::uint32_t number, const std::string& why) {
  here_.log.warn("{}: a client is refused: {}", address_, why);
  line_->send([number, why](wire::Item::Builder item) {
    auto refusal = item.initRefuse();
    refusal.setClient(number);
    refusal.setReason(forPeople(why));
  });
}

void ServerRouter::lookAtAll() {
  for (auto& [number, binding] : bindings_) look(number, binding);
}

void ServerRouter::look(std::uint32_t number, Binding& binding) {
  lookSoon();
  const bool isThere = binding.presence->look();
  const bool hasFailed = !isThere && binding.presence->isDoubtful();
  if (hasFailed && !binding.failureSaid) {
    here_.log.warn("{} at location {} cannot be offered to {}: {}", binding.name.server,
                   binding.name.location, address_, binding.presence->problem());
  }
  binding.failureSaid = hasFailed;
  if (isThere && binding.told == binding.presence->incarnation()) return;
  if (binding.told != 0 && !binding.isEnding) {
    binding.isEnding = true;
    for (auto& [clientNumber, client] : clients_) {
      if (client->binding() != number) continue;
      if (client->isConnected()) client->hearOfEnd();
      else client->giveUp(Fate::neverTaken, "the server is gone");
    }
  }
  if (binding.isEnding) return endIfDone(number, binding);
  if (isThere) tellThere(number, binding);
}

// A server that nobody has connected to may end without a sound, and what could not be looked at
// may be there.
void ServerRouter::lookAtDoubtful() {
  for (auto& [number, binding] : bindings_) {
    if (binding.presence->isDoubtful()) look(number, binding);
    else if (binding.told != 0 && binding.connected == 0) lookSoon();
  }
}

void ServerRouter::lookSoon() { looks_.setAt(Deadline::after(kLookEvery)); }

// "Absent" comes after the ends of all that was asked of the server: when each client has heard
// that it is gone.
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
  binding.told = 0;
  tellAbsent(number, binding);
  if (binding.presence->look()) tellThere(number, binding);
}

void ServerRouter::tellThere(std::uint32_t number, Binding& binding) {
  binding.told = binding.presence->incarnation();
  const auto queueSize = binding.queueSize = binding.presence->queueSize();
  const auto maxBodyBytes = std::max(binding.presence->maxMessageBytes(), kMostBesideElements);
  line_->send([number, queueSize, incarnation = binding.told,
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

void ServerRouter::tellAbsent(std::uint32_t number, Binding& binding) {
  line_->send([number, why = binding.presence->problem()](wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(number);
    server.setState(wire::Server::State::ABSENT);
    server.setReason(forPeople(why));
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
    throw ProtocolError(FarewellCode::PROTOCOL,
                        fmt::format("client {} after {}", number, lastClient_));
  if (clients_.size() >= line_->limits().maxClients) {
    throw ProtocolError(FarewellCode::LIMIT,
                        fmt::format("more than {} clients", line_->limits().maxClients));
  }
  lastClient_ = number;
  const auto binding = bindings_.find(open.getBinding());
  // The server that it was meant for went while this was on its way: its requests find nobody.
  const bool isMeant = binding != bindings_.end() && binding->second.told != 0 &&
                       binding->second.told == open.getIncarnation();
  if (!isMeant || binding->second.isEnding) return;
  try {
    addClient(open, binding->second);
  } catch (const std::exception& error) {  // no memory or no descriptor for its dispatcher
    refuseClient(number, error.what());
  }
}

void ServerRouter::addClient(wire::Open::Reader open, Binding& binding) {
  const auto number = open.getClient();
  if (!dispatcher_) {
    dispatcher_ = std::make_unique<Dispatcher>(
        here_.backplane, DispatcherOptions{WaitMode::block, "router " + line_->peer().router});
    readable_ = std::make_unique<Readable>(here_.port, dispatcher_->descriptor(),
                                           [this] { runDispatcher(); });
  }
  auto client =
      std::make_unique<FarClient>(here_, *this, *dispatcher_,
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

// Within the callback of that client.
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
  const auto end = Deadline::after(kWithClients);
  bool isThrough = false;
  while (!isThrough && !end.hasPassed() && line_->hasRoom())
    isThrough = dispatcher_->runPending(kBatches);
  dropped_.clear();
  if (!isThrough && line_->hasRoom()) return timer_.setAt(Deadline::after(Nanoseconds(0)));
  scheduleTimer();
}

// The dispatcher has things to do at times, too.
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
    default:  // of a newer peer
      return;
  }
}

void ServerRouter::onRoom() {
  if (dispatcher_) runDispatcher();
}

// What was asked for has been done, but what came of it cannot be said.
void ServerRouter::onUnsendable(const Carried& carried, const std::string& why,
                                wire::Item::Builder instead) {
  here_.log.warn("a reply to {} is lost: {}", address_, why);
  // The window that it took comes back from nobody else.
  if (const auto client = clients_.find(carried.client); client != clients_.end())
    client->second->credit(windowBytesOf(carried.message));
  if (!carried.isFirst) return;
  auto end = instead.initFate();
  end.setClient(carried.client);
  end.setRequestId(carried.requestId);
  end.setFate(wire::Fate::OUTCOME_UNKNOWN);
  end.setReason(forPeople(why));
}

}  // namespace mpf::router
