// SPDX-License-Identifier: MIT
#include "router/outgoing/client_router.h"

#include <algorithm>
#include <chrono>

#include "router/transport/kj_text.h"
#include "shm/histogram.h"

namespace mpf::router {

ClientRouter::ClientRouter(RouterContext& context, const Remote& remote)
    : context_(context),
      remote_(remote),
      record_(context.statistics.add(layout::RouterRole::client)),
      log_(context.log.forObject()),
      retryDelay_(context.config.limits.firstRetry),
      dialer_(context, remote_),
      servers_(context, remote_, *record_, log_) {
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
  state_ = State::stopping;
  auto isClosed = kj::Promise<void>(kj::READY_NOW);
  if (line_) {
    line_->end(FarewellCode::STOPPING, "the router is stopping");
    isClosed = loop_.addBranch();
  }
  return isClosed.then([this] { return servers_.whenProxiesAreGone(); });
}

// A failure to connect is handled as the end of a line: the router waits and tries again.
kj::Promise<void> ClientRouter::connectLoop() {
  return kj::evalNow([this] { return runOnce(); })
      .then([this](const LineEnd& end) { onLineEnd(end.text); },
            [this](kj::Exception&& error) { onLineEnd(toStd(error.getDescription())); })
      .then([this]() -> kj::Promise<void> {
        if (state_ == State::stopping) return kj::READY_NOW;
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
  if (state_ == State::stopping) return LineEnd{"the router is stopping"};
  state_ = State::connecting;
  record_->setState(layout::RouterLineState::connecting);
  return dialer_.dial().then(
      [this](kj::Own<kj::AsyncIoStream> stream) { return runLine(kj::mv(stream)); });
}

kj::Promise<LineEnd> ClientRouter::runLine(kj::Own<kj::AsyncIoStream> stream) {
  if (state_ == State::stopping) return LineEnd{"the router is stopping"};
  line_ = std::make_unique<Line>(
      kj::mv(stream), remote_.security,
      Line::Loop{context_.timer, context_.writes, context_.polling}, context_.config.limits,
      *record_,
      Line::Events{
          .onGreeting = [this](const PeerGreeting& greeting) { onGreeting(greeting); },
          .onItem = [this](wire::Item::Reader item) { servers_.handle(item); },
          .onPlain = [this](PlainItem& item) { servers_.handle(item); },
          .onPlainItems = [this](const PlainItems& items) { servers_.handle(items); },
          .onRoom = [this] { servers_.pump(); },
          .onHandled = [this] { context_.lookForAnswers(); },
          .onUnsendable = [this](const Carried& request, const std::string& why,
                                 wire::Item::Builder) { servers_.refuse(request, why); },
      });
  return line_->run(
      [this](wire::Item::Builder item) { fillGreeting(item.initGreeting(), context_); });
}

void ClientRouter::onGreeting(const PeerGreeting& greeting) {
  state_ = State::connected;
  connectedNs_ = Clock::nowNs();
  problem_.clear();
  count((*record_)->connects);
  record_->setProblem({});  // first: tools show it beside the state
  record_->setState(layout::RouterLineState::connected);
  log_.info("connected to {} at {} ({})", greeting.router, remote_.address.text(),
            greeting.program);
  servers_.connect(*line_);
}

void ClientRouter::onLineEnd(const std::string& why) {
  logEnd(why);
  problem_ = why;
  // The delay grows also when a peer greets and closes the connection soon afterwards.
  const bool lasted = state_ == State::connected &&
                      Clock::nowNs() - connectedNs_ >=
                          std::chrono::nanoseconds(context_.config.limits.deadTime).count();
  if (lasted) retryDelay_ = context_.config.limits.firstRetry;
  if (state_ != State::stopping) state_ = State::waiting;
  record_->setState(layout::RouterLineState::waiting);
  record_->setProblem(why);
  (*record_)->inQueue.store(0, std::memory_order_relaxed);
  (*record_)->roundTripNs.store(0, std::memory_order_relaxed);
  servers_.disconnect(why);
  line_.reset();
}

void ClientRouter::logEnd(const std::string& why) {
  if (state_ == State::connected)
    log_.warn("lost the connection to {}: {}", remote_.address.text(), why);
  else if (state_ != State::stopping && problem_ != why)
    log_.warn("cannot reach {}: {}", remote_.address.text(), why);
}

}  // namespace mpf::router
