// SPDX-License-Identifier: MIT
#include <mpf/message_server.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <stdexcept>

#include "base/stop_signals.h"
#include "server/server_core.h"
#include "shm/layout.h"

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

MessageServer::MessageServer(const Backplane& backplane, const std::string& name,
                             const ServerOptions& options)
    : MessageServer(std::make_unique<ServerCore>(backplane, name, options)) {}

MessageServer::MessageServer(std::unique_ptr<ServerCore> core) noexcept : core_(std::move(core)) {}

MessageServer::~MessageServer() = default;

const std::string& MessageServer::getName() const noexcept { return core_->name(); }
std::int32_t MessageServer::location() const noexcept { return core_->location(); }
void MessageServer::setQueueSize(int size) { core_->setQueueSize(size); }
bool MessageServer::waitForMessage(Deadline deadline) { return core_->wait(deadline); }
Message MessageServer::receive() { return core_->receive(); }
void MessageServer::interrupt() noexcept { core_->interrupt(); }
std::uint64_t MessageServer::clientOf(const Message& request) const noexcept {
  return Connections::clientOf(request.route());
}
bool MessageServer::isClientConnected(const Message& request) const noexcept {
  return Connections::isConnected(request.route());
}
void MessageServer::onClient(std::function<void(std::uint64_t, bool)> callback) {
  core_->connections().onClient(std::move(callback));
}
ReplyResult MessageServer::reply(Message&& message) { return core_->replies().send(message); }

RepliedMany MessageServer::replyMany(std::span<Message> replies) noexcept {
  return core_->replies().sendMany(replies);
}
RepliedMany MessageServer::replyBodies(const Message& request, MessageType type, std::size_t size,
                                       std::span<const std::byte> bodies) noexcept {
  return core_->replies().sendBodies(request, {type, size, bodies});
}
void MessageServer::refuse(Message&& request) { const Message dropped = std::move(request); }
BodyBytes MessageServer::allocate(const Message& request, std::size_t bytes) {
  return ReplySender::allocate(request.route(), bytes);
}
BodyBytes MessageServer::allocateShared(std::size_t bytes) {
  return core_->publisher().allocate(bytes);
}
std::size_t MessageServer::publish(const Message& message, std::span<const Message> requests,
                                   std::span<ReplyResult> results) noexcept {
  return core_->publisher().publish(message, requests, results);
}
int MessageServer::descriptor() { return core_->descriptor(); }

void MessageServer::setHandler(MessageType type, std::function<void(Message&&)> handler) {
  core_->handlers().set(type, std::move(handler));
}

void MessageServer::setRunHandler(MessageType type, std::size_t size,
                                  std::span<std::byte> (*fields)(Message&),
                                  std::function<void(std::span<std::byte>)> handler) {
  const auto handle = std::make_shared<HandleRun>(std::move(handler));
  auto forMessage = [this, fields, handle](Message&& request) {
    const auto original = fields(request);
    if (original.empty()) return refuse(std::move(request));
    // A copy, as in a run: a body in shared memory may change.
    alignas(8) std::array<std::byte, Message::kInlineBytes> bytes;
    const auto value = std::span(bytes).first(original.size());
    std::ranges::copy(original, value.begin());
    (*handle)(value);
    std::ranges::copy(value, original.begin());
    static_cast<void>(reply(std::move(request)));
  };
  HandleRun forRun;
  if (size == layout::kFirstSlotBodyBytes) forRun = [handle](auto values) { (*handle)(values); };
  core_->handlers().set(type, std::move(forMessage), std::move(forRun));
}

void MessageServer::refuseEmptyHandler(std::string_view type) {
  throw std::invalid_argument(fmt::format("MessageServer::on(): the handler of {} is empty", type));
}

bool MessageServer::handleOne() {
  bool hasHandledRun = false;
  if (auto request = core_->receiveOrHandleRun(hasHandledRun)) handle(std::move(request));
  else if (!hasHandledRun) return false;
  core_->endHandling();
  return true;
}

void MessageServer::handle(Message&& request) {
  const auto* const handler = core_->handlers().find(static_cast<std::uint16_t>(request.getType()));
  if (handler == nullptr) return refuse(std::move(request));
  // If it throws, the request is destroyed without a reply, which refuses it.
  core_->callHandler([&] { (*handler)(std::move(request)); });
}

void MessageServer::run() {
  const ServerCore::Run run(*core_);
  while (waitForMessage()) {
    while (!core_->isInterrupted() && handleOne()) {
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
  core_->acceptor().onShortage(std::move(callback));
}
void MessageServer::countAlarm() noexcept { core_->countAlarm(); }

void MessageServer::report() const {
  const auto counts = core_->counts();
  fmt::print("{}\n{:>19} {}\n{:>19} {}\n{:>19} {}\n{:>19} {}\n{:>19} {}\n", getName(), "queueSize",
             counts.queueSize, "inQueue", counts.inQueue, "queueRequests", counts.requests,
             "queueFullResponses", counts.queueFull, "replyRequests", counts.replies);
}

}  // namespace mpf
