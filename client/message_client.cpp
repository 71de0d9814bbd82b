// SPDX-License-Identifier: MIT
#include <mpf/message_client.h>

#include <algorithm>
#include <stdexcept>

#include "client/binding.h"
#include "client/dispatcher_impl.h"

namespace mpf {

const char* toString(SendResult result) noexcept {
  switch (result) {
    case SendResult::sent:
      return "sent";
    case SendResult::notConnected:
      return "not connected";
    case SendResult::queueFull:
      return "the server's queue is full";
    case SendResult::tooManyOutstanding:
      return "too many requests without a reply";
    case SendResult::tooLarge:
      return "larger than the server allows";
    case SendResult::noMemory:
      return "no shared memory left";
    case SendResult::empty:
      return "an empty message";
  }
  return "unknown";
}

MessageClient::MessageClient(const Backplane& backplane, Callback callback)
    : MessageClient(Dispatcher::shared(backplane), std::move(callback)) {}

MessageClient::MessageClient(std::shared_ptr<Dispatcher> shared, Callback callback)
    : MessageClient(*shared, std::move(callback)) {
  shared_ = std::move(shared);
}

MessageClient::MessageClient(Dispatcher& dispatcher, Callback callback)
    : dispatcher_(dispatcher.impl_) {
  dispatcher_->endpoint().forkGuard().check("Dispatcher");
  if (!callback) throw std::invalid_argument("MessageClient: an empty callback");
  binding_ = std::make_shared<Binding>(dispatcher_->parts(), std::move(callback));
  // Allocated here, because the command may run on another thread, where no caller can handle
  // std::bad_alloc.
  const auto place = std::make_shared<BindingRounds::Place>(binding_);
  dispatcher_->commands().runOrPost(
      [dispatcher = dispatcher_.get(), place] { dispatcher->bindings().add(std::move(*place)); });
}

MessageClient::~MessageClient() {
  if (isInherited()) return;
  dispatcher_->remove(*binding_);
}

void MessageClient::bind(const std::string& server, std::int32_t location) {
  dispatcher_->endpoint().forkGuard().check("MessageClient");
  binding_->setServer(server, location);
  // Neither way to connect needs memory: the client is bound now.
  const auto connect = [binding = binding_.get()] { binding->tryConnect(); };
  if (!dispatcher_->commands().tryRun(connect)) binding_->connectSoon();
}

void MessageClient::setValueHandler(
    MessageType type, std::size_t size,
    std::function<void(std::span<const std::byte> values, const Message& first)> callback) {
  binding_->setValueHandler({type, size, std::move(callback)});
}

SendResult MessageClient::send(Message&& message, Deadline takeBefore, std::uint32_t* requestId,
                               Retry retry) noexcept {
  if (isInherited()) return SendResult::notConnected;
  return binding_->send(message, takeBefore, requestId, retry);
}

SentMany MessageClient::sendMany(std::span<Message> messages, Deadline takeBefore,
                                 std::span<std::uint32_t> requestIds) noexcept {
  if (isInherited()) return {0, SendResult::notConnected};
  return binding_->sendMany(messages, takeBefore, requestIds);
}

SentMany MessageClient::sendBodies(MessageType type, std::size_t size,
                                   std::span<const std::byte> bodies, Deadline takeBefore,
                                   std::span<std::uint32_t> requestIds) noexcept {
  if (isInherited()) return {0, SendResult::notConnected};
  return binding_->sendBodies({type, size, bodies}, takeBefore, requestIds);
}

BodyBytes MessageClient::allocate(std::size_t bytes) {
  return isInherited() ? allocateHeapBody(bytes) : binding_->allocate(bytes);
}

void MessageClient::cancel(std::uint32_t requestId) {
  if (isInherited()) return;
  dispatcher_->commands().post([binding = binding_, requestId] { binding->cancel(requestId); });
}

bool MessageClient::isInherited() const noexcept {
  return dispatcher_->endpoint().forkGuard().isInherited();
}
bool MessageClient::isConnected() const noexcept {
  return !isInherited() && binding_->isConnected();
}
std::uint64_t MessageClient::maxMessageBytes() const noexcept {
  return isInherited() ? 0 : binding_->maxMessageBytes();
}
std::int32_t MessageClient::serverPid() const noexcept {
  return isInherited() ? 0 : binding_->serverPid();
}
std::string MessageClient::notConnectedBecause() const {
  return isInherited() ? ForkGuard::explain("MessageClient") : binding_->notConnectedBecause();
}

bool MessageClient::connectWait(Nanoseconds timeout) {
  if (isInherited()) return false;
  // A callback that this function runs may destroy the client.
  const auto dispatcher = dispatcher_;
  const auto binding = binding_;
  const auto deadline = Deadline::after(timeout);
  const auto isDone = [&binding] { return binding->isConnected() || binding->hasLeft(); };
  while (!isDone() && !deadline.hasPassed()) {
    if (dispatcher->tryRunUntil(deadline, isDone)) continue;
    // Another thread runs the dispatcher; if it stops, this thread must run it.
    static_cast<void>(binding->waitConnected(
        dispatcher->hasThread()
            ? deadline
            : std::min(deadline, Deadline::after(CommandQueue::kLookForRunner))));
  }
  return binding->isConnected();
}

}  // namespace mpf
