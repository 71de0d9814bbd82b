// SPDX-License-Identifier: MIT
// Binding: sends requests.
#include <mutex>
#include <utility>

#include "base/step.h"
#include "client/binding.h"
#include "client/dispatcher_impl.h"
#include "shm/histogram.h"

namespace mpf {

SendResult Binding::send(Message& message, Deadline takeBefore, std::uint32_t& requestId) noexcept {
  if (!message) return SendResult::empty;
  LinkSend sent{};
  bool nudging = false;
  {
    const std::lock_guard lock(*lock_);
    if (!isConnected()) return SendResult::notConnected;
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
    // trySendLocked() returns.
    requests_->add(*request, id);
    MPF_STEP(request_added);
    sent = channel_->trySendLocked(envelope, message, {link.header().queueSize, 0, 0});
    if (sent != LinkSend::sent && sent != LinkSend::sentInPlace) {
      requests_->takeBack(*request);
      count(link.control().clientRefused);
      if (sent == LinkSend::full) noteFull();
    } else {
      isFullReported_ = false;
      nudging = std::exchange(nudging_, true);
      link.control().clientSent.store(link.outgoing().messages(), std::memory_order_relaxed);
      link.control().clientUnanswered.store(requests_->awaited(), std::memory_order_relaxed);
      requestId = id;
    }
  }
  switch (sent) {
    case LinkSend::sent:
    case LinkSend::sentInPlace:
      message.reset();
      break;
    case LinkSend::full:
      return SendResult::queueFull;
    case LinkSend::tooLarge:
      return SendResult::tooLarge;
    case LinkSend::noMemory:
      return SendResult::noMemory;
  }
  MPF_STEP(request_sent);
  if (!nudging) wakeAt(Clock::nowNs() + kFirstNudgeNs);
  if (!takeBefore.isNever()) wakeAt(takeBefore.ns());
  return SendResult::sent;
}

// Counts each refusal, and reports a series of them once, in its place among the other messages.
void Binding::noteFull() noexcept try {
  // Clients on other threads count here, too.
  dispatcher_.endpoint().control().queueFull.fetch_add(1, std::memory_order_relaxed);
  if (isFullReported_) return;
  isFullReported_ = true;
  dispatcher_.postLater([weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->reportQueueFull();
  });
} catch (const std::bad_alloc&) {
  isFullReported_ = false;
}

BodyBytes Binding::allocate(std::size_t bytes) {
  std::shared_ptr<MessageLink> channel;
  {
    const std::lock_guard lock(*lock_);
    channel = channel_;
  }
  return channel ? channel->allocate(bytes) : allocateHeapBody(bytes);
}

}  // namespace mpf
