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

}  // namespace

SendResult RequestSender::send(Message& message, Deadline takeBefore,
                               std::uint32_t& requestId) noexcept {
  if (!message) return SendResult::empty;
  bool startsNudging = false;
  {
    const std::lock_guard lock(*lock_);
    const auto result = trySendLocked(message, takeBefore, requestId, startsNudging);
    if (result != SendResult::sent) return result;
  }
  message.reset();
  MPF_STEP(request_sent);
  if (startsNudging) timer_.wakeAt(Clock::nowNs() + NudgeInterval::kFirstNs);
  if (!takeBefore.isNever()) timer_.wakeAt(takeBefore.ns());
  return SendResult::sent;
}

// After a successful send, the caller resets `message` without the lock.
SendResult RequestSender::trySendLocked(Message& message, Deadline takeBefore,
                                        std::uint32_t& requestId, bool& startsNudging) noexcept {
  if (state_.load(std::memory_order_relaxed) != BindingState::connected)
    return SendResult::notConnected;
  auto& link = channel_->link();
  std::uint32_t id = requestId;
  auto* request = requests_->tryReserve(id);
  if (request == nullptr) {
    count(link.control().clientRefused);
    noteFull();
    return SendResult::tooManyOutstanding;
  }
  Envelope envelope;
  envelope.type = static_cast<std::uint16_t>(message.getType());
  envelope.requestId = id;
  envelope.clientType = message.getClientType();
  envelope.clientExtra = message.getClientExtra();
  envelope.deadlineNs = takeBefore.isNever() ? 0 : std::max<std::int64_t>(takeBefore.ns(), 1);
  request->clientType = envelope.clientType;
  request->clientExtra = envelope.clientExtra;
  request->ordinal = link.outgoing().messages() + 1;
  request->deadlineNs = envelope.deadlineNs;
  request->sentNs = link.shouldSampleTime() ? Clock::nowNs() : 0;
  if (request->sentNs != 0) envelope.sentTick = Tick::of(request->sentNs);
  // Added before the message is sent, because the dispatcher may receive the reply before
  // trySendLocked() of the channel returns.
  requests_->add(*request, id);
  MPF_STEP(request_added);
  const auto result =
      resultOf(channel_->trySendLocked(envelope, message, {link.header().queueSize, 0, 0}));
  if (result != SendResult::sent) {
    requests_->takeBack(*request);
    count(link.control().clientRefused);
    if (result == SendResult::queueFull) noteFull();
    return result;
  }
  isFullReported_ = false;
  startsNudging = !std::exchange(isNudging_, true);
  link.control().clientSent.store(link.outgoing().messages(), std::memory_order_relaxed);
  link.control().clientUnanswered.store(requests_->awaited(), std::memory_order_relaxed);
  requestId = id;
  return result;
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
  auto requests = std::make_shared<RequestTable>(channel->link().header().maxOutstanding,
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
