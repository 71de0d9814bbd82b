// SPDX-License-Identifier: MIT
#include "router/incoming/server_router.h"

#include <vector>

#include "shm/histogram.h"

namespace mpf::router {

ServerRouter::ServerRouter(RouterContext& context, kj::Own<kj::AsyncIoStream> stream,
                           const std::string& peer, const std::string& address, bool isTls)
    : context_(context),
      peer_(peer),
      address_(address),
      record_(context.statistics.add(layout::RouterRole::server)),
      line_(kj::mv(stream), isTls ? Security::tls : Security::plain,
            {context.timer, context.writes, context.polling}, context.config.limits, *record_,
            lineEvents()),
      servers_(context, line_, *record_, peer, address) {
  record_->setAddress(address);
  record_->setState(layout::RouterLineState::connecting);
  (*record_)->isTls.store(isTls ? 1 : 0, std::memory_order_relaxed);
  setRecordLocations();
}

Line::Events ServerRouter::lineEvents() {
  return {
      .onGreeting = [this](const PeerGreeting& greeting) { onGreeting(greeting); },
      .onItem = [this](wire::Item::Reader item) { servers_.handle(item); },
      .onPlain = [this](PlainItem& item) { servers_.handle(item); },
      .onPlainItems = [this](const PlainItems& items) { servers_.handle(items); },
      .onRoom = [this] { servers_.run(); },
      .onTraffic = [this] { servers_.onTraffic(); },
      .onHandled = [this] { context_.lookForAnswers(); },
      .onUnsendable = [this](
                          const Carried& reply, const std::string& why,
                          wire::Item::Builder instead) { servers_.loseReply(reply, why, instead); },
  };
}

kj::Promise<void> ServerRouter::run() {
  return line_.run([this](wire::Item::Builder item) { greet(item.initGreeting()); })
      .then([this](const LineEnd& end) {
        context_.log.info("{} at {} disconnected: {}",
                          line_.peer().router.empty() ? "a peer" : line_.peer().router, address_,
                          end.text);
      });
}

void ServerRouter::greet(wire::Greeting::Builder greeting) const {
  fillGreeting(greeting, context_);
  const auto& serve = context_.config.serve;
  auto locations = greeting.initLocations(static_cast<capnp::uint>(serve.size()));
  for (capnp::uint at = 0; at < locations.size(); ++at) locations.set(at, serve[at].location);
  greeting.setMaxClients(line_.limits().maxClients);
}

void ServerRouter::onGreeting(const PeerGreeting& greeting) {
  count((*record_)->connects);
  record_->setState(layout::RouterLineState::connected);
  context_.log.info("{} at {} is connected ({}{}{})", greeting.router, address_, greeting.program,
                    peer_.empty() ? "" : ", certificate of ", peer_);
}

void ServerRouter::setRecordLocations() {
  std::vector<std::int32_t> locations;
  locations.reserve(context_.config.serve.size());
  for (const auto& serve : context_.config.serve) locations.push_back(serve.location);
  record_->setLocations(locations);
}

void ServerRouter::stop() { line_.end(FarewellCode::STOPPING, "the router is stopping"); }

void ServerRouter::onConfig() {
  setRecordLocations();
  servers_.onConfig();
}

}  // namespace mpf::router
