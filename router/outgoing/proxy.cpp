// SPDX-License-Identifier: MIT
#include "router/outgoing/proxy.h"

#include <algorithm>
#include <fmt/format.h>

#include "router/transport/kj_text.h"
#include "server/programs/server_log.h"

namespace mpf::router {
namespace {

// Pauses before a held reply is sent to its client again.
constexpr std::chrono::milliseconds kFirstRetry{1};
constexpr std::chrono::milliseconds kLastRetry{50};
constexpr int kAtOnce = 1024;  // requests before the event loop runs its other tasks
constexpr std::chrono::seconds kOpenAgain{1};  // pause after a refusal
constexpr int kMaxBorrowed = 64;  // the highest value

ServerOptions optionsFor(const RouterContext& context, const ServerName& name,
                         const Proxy::Offer& offer, std::uint64_t maxMessageBytes) {
  ServerOptions options;
  options.location = name.location;
  options.queueSize = std::max(static_cast<int>(offer.queueSize), 1);
  const auto maxOffered = std::min(offer.maxMessageBytes, maxMessageBytes);
  options.maxMessageBytes =
      std::min(maxOffered + kMaxHeaderBytes, std::max(maxMessageBytes, kMaxHeaderBytes));
  options.waitMode = WaitMode::block;
  options.rights = context.config.rights;
  options.maxBorrowed = kMaxBorrowed;
  return options;
}

}  // namespace

Proxy::Proxy(RouterContext& context, RemoteConnection& connection, const ServerName& name,
             const Offer& offer)
    : context_(context),
      connection_(connection),
      name_(name),
      offer_(offer),
      log_(connection.log()),
      retry_(context.timer, [this] { retryHeld(); }),
      server_(context.backplane, name.server,
              optionsFor(context, name, offer, connection.line().maxMessageBytes()),
              std::min(offer.hops, kMaxHops) + 1),
      again_(context.timer, [this] { onReadable(); }) {
  logShortages(server_, log_);
  server_.onClient([this](std::uint64_t client, bool isThere) { onClient(client, isThere); });
  readable_ =
      std::make_unique<Readable>(context.port, server_.descriptor(), [this] { onReadable(); });
}

Proxy::~Proxy() {
  context_.endPolling(*this);
  for (const auto& [number, client] : clients_) connection_.removeClient(number);
}

// ---- to the far server

// Requests that are refused at once take no room in the line. Their number is not bounded, so the
// rest waits for the next turn of the event loop.
void Proxy::onReadable() {
  if (pump(kAtOnce) && connection_.line().hasRoom()) again_.setAt(Deadline::after(Nanoseconds(0)));
}

// Returns false when the peer accepts no more clients now.
bool Proxy::tryOpen(std::uint64_t local) {
  const auto number = connection_.tryAddClient(*this);
  numbers_[local] = number.value_or(0);
  if (!number) return false;
  const auto window = context_.config.limits.windowBytes;
  auto& client = clients_[*number];
  client.number = *number;
  client.local = local;
  client.window = ReplyWindow(window);
  connection_.line().send([number = *number, binding = offer_.binding,
                           incarnation = offer_.incarnation, window](wire::Item::Builder item) {
    auto open = item.initOpen();
    open.setClient(number);
    open.setBinding(binding);
    open.setIncarnation(incarnation);
    open.setWindow(window);
  });
  return true;
}

void Proxy::close(std::uint32_t number) {
  recent_ = nullptr;
  unanswered_ -= clients_.at(number).unanswered;
  clients_.erase(number);
  connection_.removeClient(number);
  connection_.line().send([number](wire::Item::Builder item) { item.setClose(number); });
}

void Proxy::onClient(std::uint64_t local, bool isThere) {
  if (isThere) {
    tryOpen(local);
  } else if (const auto found = numbers_.find(local); found != numbers_.end()) {
    if (found->second != 0) close(found->second);
    numbers_.erase(found);
  }
}

bool Proxy::pump(int most) {
  if (isDraining()) return false;
  state_ = State::ready;
  bool hasTaken = false;
  while (most != 0 && connection_.line().hasRoom()) {
    std::uint64_t local = 0;
    auto request = server_.receive(
        run_, local, std::min(static_cast<std::size_t>(most), connection_.line().room()));
    if (!request && local == 0) {
      state_ = State::idle;
      break;
    }
    hasTaken = true;
    if (request) {
      forward(std::move(request));
      --most;
    } else {
      forward(local, run_);
      most -= static_cast<int>(run_.size());
    }
  }
  if (hasTaken) {
    context_.noteTraffic();
    context_.poll(*this);
  }
  return hasMore();
}

// Returns nullptr when the client has disconnected or the peer accepts no more clients.
Proxy::Client* Proxy::tryFindSender(std::uint64_t local) {
  if (recent_ == nullptr || recent_->local != local || recent_->refusal)
    recent_ = tryFindOrOpen(local);
  return recent_;
}

Proxy::Client* Proxy::tryFindOrOpen(std::uint64_t local) {
  const auto found = numbers_.find(local);
  if (found == numbers_.end()) return nullptr;
  if (const auto known = clients_.find(found->second);
      known != clients_.end() && known->second.unanswered == 0 && known->second.refusal &&
      known->second.refusal->openAgain.hasPassed()) {
    close(found->second);
    found->second = 0;
  }
  if (found->second == 0 && !tryOpen(local)) return nullptr;
  return &clients_.at(found->second);
}

void Proxy::forward(Message request) {
  auto* const client = tryFindSender(server_.clientOf(request));
  if (client == nullptr) return;  // destroying the handle refuses the request
  // From here on, the far server or this class ends the request, not the destructor of its handle.
  request.exchangeKeeper(nullptr);
  const auto requestId = request.route().requestId;
  ++client->unanswered;
  ++unanswered_;
  if (client->refusal)
    return endRequest(client->number, requestId, Fate::refused, client->refusal->why);
  const auto takeBefore = server_.takeBefore();
  if (takeBefore.isNever() && PlainItem::canCarry(request))
    return connection_.line().send(PlainOutgoing{true, false, client->number, requestId, request});
  connection_.line().send(Carried{.isRequest = true,
                                  .client = client->number,
                                  .requestId = requestId,
                                  .takeBefore = takeBefore,
                                  .message = std::move(request)});
}

void Proxy::forward(std::uint64_t local, const MessageRun& requests) {
  auto* const client = tryFindSender(local);
  if (client == nullptr) return server_.refuse(local, requests);
  const auto count = static_cast<std::uint32_t>(requests.size());
  client->unanswered += count;
  unanswered_ += count;
  if (!client->refusal)
    return connection_.line().send(PlainItems{true, false, client->number, requests});
  for (std::size_t at = 0; at < requests.size(); ++at)
    endRequest(client->number, requests[at].requestId(), Fate::refused, client->refusal->why);
}

void Proxy::drain(Fate fate) {
  if (isDraining()) return;
  state_ = State::draining;
  drainUntil_ = Deadline::after(context_.config.limits.deadTime);
  for (const auto& [number, client] : clients_) {
    for (const auto requestId : server_.unanswered(client.local)) end(number, requestId, fate);
  }
}

bool Proxy::isDone() const noexcept {
  if (!isDraining()) return false;
  const bool isEmpty = unanswered_ == 0 && std::ranges::all_of(clients_, [](const auto& each) {
                         return each.second.held.empty();
                       });
  return isEmpty || drainUntil_.hasPassed();
}

// ---- from the far server

// Whether a request is pending: no reply or fate has been delivered, and none is held for it.
bool Proxy::awaits(const Client& client, std::uint32_t requestId) const noexcept {
  return server_.isUnanswered(client.local, requestId) &&
         std::ranges::none_of(client.held,
                              [&](const Held& held) { return held.requestId == requestId; });
}

void Proxy::ended(Client& client, std::uint32_t requests) noexcept {
  client.unanswered -= requests;
  unanswered_ -= requests;
}

Proxy::Client* Proxy::tryFind(std::uint32_t number) {
  if (recent_ != nullptr && recent_->number == number) return recent_;
  const auto found = clients_.find(number);
  return found == clients_.end() ? nullptr : recent_ = &found->second;
}

// Returns whether the reply ends its request.
//   throws  ProtocolError: the peer must not send it now
bool Proxy::checkReply(const Client& client, std::uint32_t requestId, bool isFirst) const {
  const bool endsRequest = awaits(client, requestId);
  if (isFirst != endsRequest) {
    throw ProtocolError(
        FarewellCode::PROTOCOL,
        fmt::format("received a {} reply to request {} of client {}: the request {}",
                    isFirst ? "first" : "further", requestId, client.number,
                    endsRequest ? "has had no first reply" : "is not pending"));
  }
  if (client.window.isUsedUp())
    throw ProtocolError(FarewellCode::LIMIT,
                        fmt::format("received a reply to client {} beyond its window of {} bytes",
                                    client.number, client.window.bytes()));
  return endsRequest;
}

void Proxy::reply(PlainItem& item) {
  auto* const client = tryFind(item.client);
  if (client == nullptr || isDraining()) return;
  const bool endsRequest = checkReply(*client, item.requestId, item.isFirst);
  client->window.received(windowBytesOf(item.message));
  deliver(*client, item.requestId, std::move(item.message), endsRequest);
}

void Proxy::reply(const PlainItems& items) {
  auto* const client = tryFind(items.client);
  if (client == nullptr || isDraining()) return;
  std::size_t sent = 0;
  // If no reply is held, less than a quarter of the window is used, and a run fits into the rest.
  if (client->held.empty()) {
    sent = server_.replyTo(client->local, items.run, items.isFirst);
    const auto bytes = static_cast<std::uint32_t>(sent * kWindowOverheadBytes);
    client->window.received(bytes);
    if (items.isFirst) ended(*client, static_cast<std::uint32_t>(sent));
    giveCredit(*client, bytes);
  }
  for (; sent < items.run.size(); ++sent) {
    auto item = items[sent];
    reply(item);
  }
}

void Proxy::reply(std::uint32_t number, wire::Reply::Reader reply) {
  const auto found = clients_.find(number);
  // The client has disconnected, or drain() has ended its requests.
  if (found == clients_.end() || isDraining()) return;
  auto& client = found->second;
  const bool endsRequest = checkReply(client, reply.getRequestId(), reply.getIsFirst());
  ConversionError error;
  auto message = tryFromWire(
      reply.getMessage(), {static_cast<std::size_t>(connection_.line().limits().maxMessageBytes)},
      error, [&](std::size_t bytes) { return server_.allocateBody(client.local, bytes); });
  if (!message || message->getType() == MessageType::connect ||
      message->getType() == MessageType::requestFate) {
    if (error.fault != ConversionFault::unknownType && error.fault != ConversionFault::tooLarge) {
      throw ProtocolError(FarewellCode::PROTOCOL,
                          message ? "received a reply that only MPF itself may send" : error.text);
    }
    return loseReply(number, reply, error.text);
  }
  message->setRoute({0, 0, Message::missedFlags(reply.getMissed()), nullptr});
  client.window.received(windowBytesOf(*message));
  deliver(client, reply.getRequestId(), std::move(*message), endsRequest);
}

// The server has handled the request, but its reply cannot be delivered.
void Proxy::loseReply(std::uint32_t number, wire::Reply::Reader reply, const std::string& why) {
  log_.warn("{} at location {}: a reply is lost: {}", name_.server, name_.location, why);
  if (reply.getIsFirst()) endRequest(number, reply.getRequestId(), Fate::outcomeUnknown, why);
  // At least as many bytes as the reply took from the window.
  giveCredit(clients_.at(number),
             kWindowOverheadBytes + reply.getMessage().totalSize().wordCount * sizeof(capnp::word));
}

void Proxy::endRequest(std::uint32_t number, std::uint32_t requestId, Fate fate,
                       const std::string& why) {
  if (!why.empty())
    log_.debug("{} at location {}: request {}: {}", name_.server, name_.location, requestId, why);
  end(number, requestId, fate);
}

void Proxy::end(std::uint32_t number, std::uint32_t requestId, Fate fate) {
  const auto found = clients_.find(number);
  if (found == clients_.end() || !awaits(found->second, requestId)) return;
  deliver(found->second, requestId, RequestFateMessage({.fate = fate, .requestId = requestId}),
          true);
}

void Proxy::queueFull(std::uint32_t number) {
  count(connection_.record()->queueFull);
  const auto found = clients_.find(number);
  if (found == clients_.end() || found->second.heldQueueFull) return;
  found->second.heldQueueFull = true;
  deliver(found->second, 0, ConnectMessage({.status = ConnectStatus::connectQueueFull}), false);
}

void Proxy::refuse(std::uint32_t number, const std::string& why) {
  const auto found = clients_.find(number);
  if (found == clients_.end()) return;
  auto& refusal = found->second.refusal;
  if (!refusal)
    log_.warn("{} at location {} refuses a client: {}", name_.server, name_.location, why);
  refusal = std::make_unique<Refusal>(why, Deadline::after(kOpenAgain));
}

// Keeps the order: a message is queued behind those that are held.
void Proxy::deliver(Client& client, std::uint32_t requestId, Message&& message, bool endsRequest) {
  if (client.held.empty() && tryDeliver(client, requestId, message, endsRequest)) return;
  client.held.push_back({requestId, std::move(message)});
  retryAfter_ = kFirstRetry;
  retry_.setAt(Deadline::after(retryAfter_));
}

// Returns false when the client has no room for the message now.
bool Proxy::tryDeliver(Client& client, std::uint32_t requestId, Message& message,
                       bool endsRequest) {
  const bool isConnectMessage = message.getType() == MessageType::connect;
  const bool isOurs = isConnectMessage || message.getType() == MessageType::requestFate;
  const auto bytes = windowBytesOf(message);
  switch (server_.replyTo(client.local, requestId, std::move(message))) {
    case ReplyResult::queueFull:
    case ReplyResult::noMemory:
      return false;
    case ReplyResult::tooLarge:
      log_.warn("{} at location {}: a reply is larger than its client can receive", name_.server,
                name_.location);
      if (endsRequest)
        static_cast<void>(server_.replyTo(
            client.local, requestId,
            RequestFateMessage({.fate = Fate::outcomeUnknown, .requestId = requestId})));
      break;
    case ReplyResult::sent:
    case ReplyResult::clientGone:
      break;
  }
  if (endsRequest) ended(client);
  if (isConnectMessage) client.heldQueueFull = false;
  if (!isOurs) giveCredit(client, bytes);
  return true;
}

void Proxy::giveCredit(Client& client, std::uint64_t bytes) {
  const auto credit = client.window.taken(bytes);
  if (credit == 0) return;
  connection_.line().send([number = client.number, credit](wire::Item::Builder item) {
    auto to = item.initCredit();
    to.setClient(number);
    to.setBytes(credit);
  });
}

void Proxy::retryHeld() {
  for (auto& [number, client] : clients_) {
    while (!client.held.empty()) {
      auto& [requestId, message] = client.held.front();
      if (!tryDeliver(client, requestId, message, server_.isUnanswered(client.local, requestId)))
        break;
      client.held.pop_front();
    }
  }
  const bool someAreHeld =
      std::ranges::any_of(clients_, [](const auto& each) { return !each.second.held.empty(); });
  if (!someAreHeld) return;
  retryAfter_ = std::min(2 * retryAfter_, kLastRetry);
  retry_.setAt(Deadline::after(retryAfter_));
}

}  // namespace mpf::router
