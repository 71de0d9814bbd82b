// SPDX-License-Identifier: MIT
#include <mpf/message_server.h>

#include <fmt/format.h>
#include <stdexcept>

#include "base/stop_signals.h"
#include "server/server_core.h"

namespace mpf {

const char* toString(ReplyResult result) noexcept {
  switch (result) {
    case ReplyResult::sent:
      return "sent";
    case ReplyResult::clientGone:
      return "the client has disconnected";
    case ReplyResult::queueFull:
      return "reply queue full";
    case ReplyResult::tooLarge:
      return "too large";
    case ReplyResult::noMemory:
      return "no shared memory left";
  }
  return "unknown";
}

class MessageServer::Impl {
 public:
  Impl(const Backplane& backplane, const std::string& name, const ServerOptions& options)
      : core(backplane, name, options) {}

  ServerCore core;
  std::map<MessageType, std::function<void(Message&&)>> handlers;
};

MessageServer::MessageServer(const Backplane& backplane, const std::string& name,
                             const ServerOptions& options)
    : impl_(std::make_unique<Impl>(backplane, name, options)) {}

MessageServer::~MessageServer() = default;

const std::string& MessageServer::getName() const noexcept { return impl_->core.name(); }
std::int32_t MessageServer::location() const noexcept { return impl_->core.location(); }
void MessageServer::setQueueSize(int size) { impl_->core.setQueueSize(size); }
bool MessageServer::waitForMessage(Deadline deadline) { return impl_->core.wait(deadline); }
Message MessageServer::receive() { return impl_->core.receive(); }
void MessageServer::interrupt() noexcept { impl_->core.interrupt(); }
std::uint64_t MessageServer::clientOf(const Message& request) const noexcept {
  return impl_->core.clientOf(request);
}
bool MessageServer::isAwaited(const Message& request) const noexcept {
  return impl_->core.isAwaited(request);
}
ReplyResult MessageServer::reply(Message&& message) { return impl_->core.reply(message); }
void MessageServer::refuse(Message&& request) { const Message dropped = std::move(request); }
BodyBytes MessageServer::allocate(const Message& request, std::size_t bytes) {
  return impl_->core.allocate(request.route(), bytes);
}
int MessageServer::descriptor() { return impl_->core.descriptor(); }

void MessageServer::onClient(std::function<void(std::uint64_t, bool)> callback) {
  impl_->core.onClient(std::move(callback));
}
Deadline MessageServer::takeBefore() const noexcept { return impl_->core.takeBefore(); }
ReplyResult MessageServer::replyTo(std::uint64_t client, std::uint32_t requestId,
                                   Message&& message) {
  message.setRoute(impl_->core.routeTo(client, requestId));
  return impl_->core.reply(message);
}
bool MessageServer::owes(std::uint64_t client, std::uint32_t requestId) const noexcept {
  return impl_->core.owes(client, requestId);
}
std::vector<std::uint32_t> MessageServer::owed(std::uint64_t client) const {
  return impl_->core.owed(client);
}
BodyBytes MessageServer::allocateBody(std::uint64_t client, std::size_t bytes) {
  return impl_->core.allocate(impl_->core.routeTo(client, 0), bytes);
}

void MessageServer::address(Message& reply, const Message& request) noexcept {
  auto route = request.route();
  route.keeper = nullptr;
  reply.setRoute(route);
  reply.setClientType(request.getClientType());
  reply.setClientExtra(request.getClientExtra());
}

void MessageServer::setHandler(MessageType type, std::function<void(Message&&)> handler) {
  impl_->handlers[type] = std::move(handler);
}

void MessageServer::callHandler(const std::function<void(Message&&)>& handler,
                                Message&& request) try {
  handler(std::move(request));
} catch (...) {  // the handler has destroyed the request, which has refused it
  impl_->core.endHandling();
  impl_->core.callAgain();
  throw;
}

bool MessageServer::handleOne() {
  auto request = receive();
  if (!request) return false;
  const auto handler = impl_->handlers.find(request.getType());
  if (handler == impl_->handlers.end()) {
    refuse(std::move(request));
  } else {
    callHandler(handler->second, std::move(request));
  }
  impl_->core.endHandling();
  return true;
}

void MessageServer::run() {
  while (waitForMessage()) {
    while (!impl_->core.isInterrupted() && handleOne()) {
    }
  }
}

int MessageServer::runUntilSignal() {
  const StopSignals stop(
      [](void* server) noexcept { static_cast<MessageServer*>(server)->interrupt(); }, this);
  run();
  return 0;
}

void MessageServer::onShortage(std::function<void(const std::string&)> callback) {
  impl_->core.onShortage(std::move(callback));
}
void MessageServer::countAlarm() noexcept { impl_->core.countAlarm(); }

void MessageServer::report() const {
  const auto counts = impl_->core.counts();
  fmt::print("{}\n{:>19} {}\n{:>19} {}\n{:>19} {}\n{:>19} {}\n{:>19} {}\n", getName(), "queueSize",
             counts.queueSize, "inQueue", counts.inQueue, "queueRequests", counts.requests,
             "queueFullResponses", counts.queueFull, "replyRequests", counts.replies);
}

}  // namespace mpf
