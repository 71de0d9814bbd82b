// SPDX-License-Identifier: MIT
#include "client/request_sender.h"

#include <algorithm>
#include <new>
#include <utility>

#include "base/step.h"
#include "shm/histogram.h"

namespace mpf {
namespace {

SendResult resultOf(LinkSend sent) noexcept {
  switch (sent) {
    case LinkSend::sent:
    case LinkSend::sentInPlace:
      return SendResult::sent;
    case LinkSend::full:
      return SendResult::queueFull;
    case LinkSend::tooLarge:
      return SendResult::tooLarge;
    case LinkSend::noMemory:
      return SendResult::noMemory;
  }
  return SendResult::noMemory;
}

// 0: none
std::int64_t nsOf(Deadline takeBefore) noexcept {
  return takeBefore.isNever() ? 0 : std::max<std::int64_t>(takeBefore.ns(), 1);
}

std::unique_ptr<Message> tryCopy(const Message& message) noexcept try {
  return std::make_unique<Message>(message.duplicate());
} catch (const std::bad_alloc&) {
  return {};
}

}  // namespace

SendResult RequestSender::send(Message& message, Deadline takeBefore, std::uint32_t& requestId,
                               Retry retry) noexcept {
  if (!message) return SendResult::empty;
  Attempt attempt{message, nsOf(takeBefore), requestId};
  const auto result = retry == Retry::never ? send(attempt) : sendWithCopy(attempt);
  if (result == SendResult::sent) requestId = attempt.id;
  return result;
}

SendResult RequestSender::sendWithCopy(Attempt& attempt) noexcept {
  auto copy = tryCopy(attempt.message);
  if (!copy) return SendResult::noMemory;
  attempt.copy = &copy;
  return send(attempt);
}

SendResult RequestSender::send(Attempt& attempt) noexcept {
  {
    const std::lock_guard lock(*lock_);
    const auto result = untaken_.isEmpty() ? trySendLocked(attempt) : refuseBehindUntaken();
    if (result != SendResult::sent) return result;
  }
  onSent(attempt);
  return SendResult::sent;
}

SentMany RequestSender::sendMany(std::span<Message> messages, Deadline takeBefore,
                                 std::span<std::uint32_t> requestIds) noexcept {
  SentMany sent;
  bool startsNudging = false;
  {
    const std::lock_guard lock(*lock_);
    if (!untaken_.isEmpty()) return {0, refuseBehindUntaken()};
    if (state_.load(std::memory_order_relaxed) != BindingState::connected)
      return {0, SendResult::notConnected};
    const Link::Batch batch(channel_->link());
    for (; sent.count < messages.size(); ++sent.count) {
      auto& message = messages[sent.count];
      Attempt attempt{message, nsOf(takeBefore), 0};
      sent.result = message ? trySendLocked(attempt) : SendResult::empty;
      if (sent.result != SendResult::sent) break;
      startsNudging = startsNudging || attempt.startsNudging;
      if (sent.count < requestIds.size()) requestIds[sent.count] = attempt.id;
    }
  }
  for (auto& message : messages.first(sent.count)) message.reset();
  if (sent.count != 0) setTimers(startsNudging, nsOf(takeBefore));
  return sent;
}

// Without the lock.
void RequestSender::onSent(const Attempt& attempt) noexcept {
  attempt.message.reset();
  setTimers(attempt.startsNudging, attempt.deadlineNs);
}

void RequestSender::setTimers(bool startsNudging, std::int64_t deadlineNs) noexcept {
  MPF_STEP(request_sent);
  if (startsNudging) timer_.wakeAt(Clock::nowNs() + NudgeInterval::kFirstNs);
  if (deadlineNs != 0) timer_.wakeAt(deadlineNs);
}

SendResult RequestSender::refuseBehindUntaken() noexcept {
  if (state_.load(std::memory_order_relaxed) != BindingState::connected)
    return SendResult::notConnected;
  noteFull();
  return SendResult::queueFull;
}

// After a successful send, the caller calls onSent().
SendResult RequestSender::trySendLocked(Attempt& attempt) noexcept {
  if (state_.load(std::memory_order_relaxed) != BindingState::connected)
    return SendResult::notConnected;
  auto& link = channel_->link();
  auto* request = requests_->tryReserve(attempt.id);
  if (request == nullptr && requests_->maxOutstanding() < link.header().maxOutstanding) {
    // The link gets memory for the replies to as many requests as the server permits.
    if (!link.tryAllowMore() || !requests_->tryAllow(link.header().maxOutstanding)) {
      count(link.control().clientRefused);
      return SendResult::noMemory;
    }
    request = requests_->tryReserve(attempt.id);
  }
  if (request == nullptr) {
    count(link.control().clientRefused);
    noteFull();
    return SendResult::tooManyOutstanding;
  }
  const auto& message = attempt.message;
  Envelope envelope;
  envelope.type = static_cast<std::uint16_t>(message.getType());
  envelope.requestId = attempt.id;
  envelope.clientType = message.getClientType();
  envelope.clientExtra = message.getClientExtra();
  envelope.timeNs = attempt.deadlineNs;
  request->clientType = envelope.clientType;
  request->clientExtra = envelope.clientExtra;
  request->ordinal = link.outgoing().messages() + 1;
  request->deadlineNs = envelope.timeNs;
  request->sentNs = link.shouldSampleTime() ? Clock::nowNs() : 0;
  if (attempt.copy != nullptr) request->copy = std::move(*attempt.copy);
  if (request->sentNs != 0) envelope.sentTick = Tick::of(request->sentNs);
  // Added before the message is sent, because the dispatcher may receive the reply before
  // trySendLocked() of the channel returns.
  requests_->add(*request, attempt.id);
  MPF_STEP(request_added);
  const auto result =
      resultOf(channel_->trySendLocked(envelope, attempt.message, {link.header().queueSize, 0}));
  if (result != SendResult::sent) {
    auto copy = requests_->takeBack(*request);
    if (attempt.copy != nullptr) *attempt.copy = std::move(copy);
    count(link.control().clientRefused);
    if (result == SendResult::queueFull) noteFull();
    return result;
  }
  isFullReported_ = false;
  attempt.startsNudging = !std::exchange(isNudging_, true);
  link.control().clientSent.store(link.outgoing().messages(), std::memory_order_relaxed);
  link.control().clientUnanswered.store(requests_->awaited(), std::memory_order_relaxed);
  return result;
}

bool RequestSender::tryKeep(Request& request) {
  if (!request.copy || request.isGivenUp) return false;
  {
    const std::lock_guard lock(*lock_);
    untaken_.add(request);
  }
  requests_->end(request);
  return true;
}

SendResult RequestSender::trySendUntaken() {
  auto message = untaken_.front().message->duplicate();
  auto& next = untaken_.front();
  Attempt attempt{message, next.deadlineNs, next.id, &next.message};
  {
    const std::lock_guard lock(*lock_);
    const auto result = trySendLocked(attempt);
    if (result != SendResult::sent) return result;
    untaken_.removeFront();
  }
  onSent(attempt);
  return SendResult::sent;
}

// Counts each refusal, and reports a series of them once, in its place among the other messages.
void RequestSender::noteFull() noexcept try {
  // Clients on other threads count here, too.
  control_.queueFull.fetch_add(1, std::memory_order_relaxed);
  if (std::exchange(isFullReported_, true)) return;
  postFullReport_();
} catch (const std::bad_alloc&) {
  isFullReported_ = false;
}

BodyBytes RequestSender::allocate(std::size_t bytes) {
  std::shared_ptr<MessageLink> channel;
  {
    const std::lock_guard lock(*lock_);
    channel = channel_;
  }
  return channel ? channel->allocate(bytes) : allocateHeapBody(bytes);
}

std::uint64_t RequestSender::maxMessageBytes() const noexcept {
  const std::lock_guard lock(*lock_);
  return state_.load(std::memory_order_relaxed) == BindingState::connected
             ? channel_->link().maxMessageBytes()
             : 0;
}

void RequestSender::open(std::shared_ptr<MessageLink> channel) {
  auto requests = std::make_shared<RequestTable>(channel->link().maxOutstanding(),
                                                 requests_ ? requests_->lastId() : 0);
  const std::lock_guard lock(*lock_);
  requests_ = std::move(requests);
  channel_ = std::move(channel);
  isFullReported_ = false;
  isNudging_ = true;
}

void RequestSender::close() noexcept {
  const std::lock_guard lock(*lock_);
  channel_.reset();
}

bool RequestSender::isTaken(const Request& request) const noexcept {
  const std::lock_guard lock(*lock_);
  return channel_->link().outgoing().isTaken(request.ordinal);
}

bool RequestSender::tryEndNudging() noexcept {
  const std::lock_guard lock(*lock_);
  if (requests_->awaited() != 0) return false;
  isNudging_ = false;
  return true;
}

}  // namespace mpf
