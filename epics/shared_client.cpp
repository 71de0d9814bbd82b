// SPDX-License-Identifier: MIT
#include "epics/shared_client.h"

#include <algorithm>
#include <utility>

#include "epics/record_queue.h"

namespace mpf {
namespace {

bool isFull(SendResult result) noexcept {
  return result == SendResult::queueFull || result == SendResult::tooManyOutstanding;
}

Message fateOf(const Message& request, Fate fate) {
  RequestFateMessage message({.fate = fate, .requestId = 0});
  message.setClientType(request.getClientType());
  message.setClientExtra(request.getClientExtra());
  message.setRoute({0, 0, kEndsRequest, nullptr});
  return message;
}

void storeId(std::atomic<std::uint32_t>& requestId, std::uint32_t id) noexcept {
  // PAIR(request-id): after the deadline of the request before was cleared.
  requestId.store(id, std::memory_order_release);
}

}  // namespace

SharedClient::SharedClient(Dispatcher& dispatcher, std::string server, std::int32_t location)
    : server_(std::move(server)),
      location_(location),
      client_(std::make_unique<MessageClient>(
          dispatcher, [this](Message&& message) { onMessage(std::move(message)); })) {}

std::uint32_t SharedClient::add(Member& member) {
  const std::lock_guard lock(mutex_);
  members_.push_back(&member);
  if (isConnected_) member.deliver(ConnectMessage({.status = ConnectStatus::connectYes}));
  return static_cast<std::uint32_t>(members_.size() - 1);
}

void SharedClient::bind() {
  const std::lock_guard lock(mutex_);
  if (!std::exchange(isBound_, true)) client_->bind(server_, location_);
}

void SharedClient::reportAbsence() {
  const std::lock_guard lock(mutex_);
  if (isConnected_) return;
  for (auto* member : members_)
    member->deliver(ConnectMessage({.status = ConnectStatus::connectNo}));
}

SendResult SharedClient::send(std::uint32_t member, ReplyType reply, Message&& message,
                              Deadline deadline, std::atomic<std::uint32_t>& requestId) {
  message.setClientType(static_cast<std::int32_t>(member << 2) | reply);
  const auto bytes = message.body().size();
  const std::lock_guard lock(mutex_);
  if (!client_ || !client_->isConnected()) return SendResult::notConnected;
  if (backlog_.empty()) {
    const auto result = sendLocked(message, deadline, requestId);
    if (!isFull(result)) return result;
  }
  const auto mostBytes = client_->maxMessageBytes();  // 0: has been disconnected meanwhile
  if (mostBytes != 0 && bytes > mostBytes) return SendResult::tooLarge;
  if (backlog_.size() >= kMaxBacklog) return SendResult::queueFull;
  // NOLINTNEXTLINE(bugprone-use-after-move): a message that was not sent is unchanged
  backlog_.push_back({std::move(message), deadline, &requestId});
  nextDeadline_ = std::min(nextDeadline_, deadline);
  hasBacklog_.store(true, std::memory_order_relaxed);
  return SendResult::sent;
}

SendResult SharedClient::sendLocked(Message& message, Deadline deadline,
                                    std::atomic<std::uint32_t>& requestId) {
  // Allocates before the message is sent.
  clientTypes_.reserve(clientTypes_.size() + 1);
  auto entry = clientTypes_.extract(clientTypes_.try_emplace(0, message.getClientType()).first);
  std::uint32_t id = 0;
  const auto result =
      client_ ? client_->send(std::move(message), deadline, &id) : SendResult::notConnected;
  if (result == SendResult::sent) {
    entry.key() = id;
    clientTypes_.insert(std::move(entry));
    storeId(requestId, id);
  }
  return result;
}

void SharedClient::restoreClientType(Message& message) {
  if (!endsRequest(message)) return;
  const auto entry = clientTypes_.extract(message.route().requestId);
  if (entry) message.setClientType(entry.mapped());
}

void SharedClient::cancel(std::uint32_t requestId) {
  const std::lock_guard lock(mutex_);
  if (client_) client_->cancel(requestId);
}

void SharedClient::serveBacklog() {
  if (!hasBacklog_.load(std::memory_order_relaxed)) return;
  const std::lock_guard lock(mutex_);
  if (nextDeadline_.hasPassed()) endExpired();
  while (!backlog_.empty() && trySendFirst()) backlog_.pop_front();
  hasBacklog_.store(!backlog_.empty(), std::memory_order_relaxed);
}

void SharedClient::endExpired() {
  nextDeadline_ = Deadline::never();
  std::erase_if(backlog_, [&](const Waiting& waiting) {
    if (waiting.deadline.hasPassed()) {
      deliverLocked(fateOf(waiting.message, Fate::expired));
      return true;
    }
    nextDeadline_ = std::min(nextDeadline_, waiting.deadline);
    return false;
  });
}

// Returns false when the queue of the server is full.
bool SharedClient::trySendFirst() {
  auto& waiting = backlog_.front();
  const auto result = sendLocked(waiting.message, waiting.deadline, *waiting.requestId);
  if (isFull(result)) return false;
  if (result != SendResult::sent) {
    const bool isConnected = result != SendResult::notConnected;
    deliverLocked(fateOf(waiting.message, isConnected ? Fate::refused : Fate::neverTaken));
  }
  return true;
}

void SharedClient::endBacklog(Fate fate) {
  const std::lock_guard lock(mutex_);
  for (const auto& waiting : backlog_) deliverLocked(fateOf(waiting.message, fate));
  backlog_.clear();
  hasBacklog_.store(false, std::memory_order_relaxed);
}

void SharedClient::close() {
  std::unique_ptr<MessageClient> client;
  {
    const std::lock_guard lock(mutex_);
    client = std::move(client_);
  }
  client.reset();  // waits for a callback in progress, which may wait for the mutex
  endBacklog(Fate::neverTaken);
}

void SharedClient::onMessage(Message&& message) {
  if (const auto* connect = message.tryAs<Connect>()) return onConnect(*connect);
  if (message.getType() != MessageType::requestFate) setServerStopped(false);  // it has sent this
  {
    const std::lock_guard lock(mutex_);
    restoreClientType(message);
    deliverLocked(std::move(message));
  }
  serveBacklog();
}

void SharedClient::onConnect(const Connect& connect) {
  if (connect.status == ConnectStatus::connectQueueFull) return;
  if (connect.status == ConnectStatus::connectNo) endBacklog(Fate::neverTaken);
  const std::lock_guard lock(mutex_);
  isConnected_ = connect.status == ConnectStatus::connectYes;
  isServerStopped_.store(false, std::memory_order_relaxed);
  for (auto* member : members_) member->deliver(ConnectMessage(connect));
}

void SharedClient::setServerStopped(bool isStopped) {
  if (isServerStopped() == isStopped) return;
  const std::lock_guard lock(mutex_);
  if (!isConnected_) return;
  isServerStopped_.store(isStopped, std::memory_order_relaxed);
  for (auto* member : members_) member->deliver(Message());
}

void SharedClient::deliverLocked(Message&& message) noexcept {
  const auto number = static_cast<std::uint32_t>(message.getClientType()) >> 2;
  if (number < members_.size()) members_[number]->deliver(std::move(message));
}

bool SharedClient::isConnected() const {
  const std::lock_guard lock(mutex_);
  return client_ && client_->isConnected();
}

std::int32_t SharedClient::serverPid() const {
  const std::lock_guard lock(mutex_);
  return client_ ? client_->serverPid() : 0;
}

std::string SharedClient::notConnectedBecause() const {
  const std::lock_guard lock(mutex_);
  return client_ ? client_->notConnectedBecause() : "the IOC is shutting down";
}

std::size_t SharedClient::members() const {
  const std::lock_guard lock(mutex_);
  return members_.size();
}

}  // namespace mpf
