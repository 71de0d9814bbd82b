// SPDX-License-Identifier: MIT
#include "client/request_sender.h"

#include <algorithm>
#include <array>
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

// Shows the number of messages sent to the tools.
void showSent(Link& link) noexcept {
  link.control().clientSent.store(link.outgoing().messages(), std::memory_order_relaxed);
}

std::unique_ptr<Message> tryCopy(const Message& message) noexcept try {
  return std::make_unique<Message>(message.duplicate());
} catch (const std::bad_alloc&) {
  return {};
}

}  // namespace

// Lets more requests be outstanding, once, and returns `sent`; or counts and returns a refusal.
SendResult RequestSender::tryGrow() noexcept {
  auto& link = channel_->link();
  const auto most = link.header().maxOutstanding;
  if (requests_->maxOutstanding() < most) {
    // The link gets memory for the replies to as many requests as the server permits.
    if (link.tryAllowMore() && requests_->tryGrow(most)) return SendResult::sent;
    count(link.control().clientRefused);
    return SendResult::noMemory;
  }
  count(link.control().clientRefused);
  noteFull();
  return SendResult::tooManyOutstanding;
}

// The caller sets isNudging_ and calls setTimers() after it has sent one or more messages.
[[gnu::always_inline]] inline SendResult RequestSender::trySendLocked(
    Message& message, std::int64_t deadlineNs, std::uint32_t& requestId,
    std::unique_ptr<Message>* copy) noexcept {
  if (state_.load(std::memory_order_relaxed) != BindingState::connected)
    return SendResult::notConnected;
  auto& link = channel_->link();
  // Called first, so that no computed value must be saved on the stack during the call.
  const auto sentNs = link.timeOfNext();
  auto id = requestId;
  Request* request = nullptr;
  while ((request = requests_->tryReserve(id)) == nullptr) {
    if (const auto refusal = tryGrow(); refusal != SendResult::sent) return refusal;
  }
  request->clientType = message.getClientType();
  request->clientExtra = message.getClientExtra();
  request->setOrdinal(link.outgoing().messages() + 1);
  request->deadlineNs = deadlineNs;
  request->sentNs = sentNs;
  if (copy != nullptr) request->copy = std::move(*copy);
  // Added before the message is sent, because the dispatcher may receive the reply before
  // trySendLocked() of the channel returns.
  requests_->add(*request, id);
  MPF_STEP(request_added);
  const auto envelope = [&] {
    return Envelope{
        .type = static_cast<std::uint16_t>(message.getType()),
        .requestId = id,
        .clientType = detail::alone(message.getClientType()),
        .clientExtra = detail::alone(message.getClientExtra()),
        .sentTick = Tick::ofSample(sentNs),
        .timeNs = deadlineNs,
    };
  };
  const auto sent = channel_->trySendLocked(link, envelope, message, {link.header().queueSize, 0});
  if (sent != LinkSend::sent && sent != LinkSend::sentInPlace)
    return takeBack(*request, resultOf(sent), copy);
  requestId = id;
  isFullReported_ = false;
  showSent(link);
  return SendResult::sent;
}

// After a request was added but not sent.
SendResult RequestSender::takeBack(Request& request, SendResult result,
                                   std::unique_ptr<Message>* copy) noexcept {
  auto message = requests_->takeBack(request);
  if (copy != nullptr) *copy = std::move(message);
  count(channel_->link().control().clientRefused);
  if (result == SendResult::queueFull) noteFull();
  return result;
}

SendResult RequestSender::refuseBehindUntaken() noexcept {
  if (state_.load(std::memory_order_relaxed) != BindingState::connected)
    return SendResult::notConnected;
  noteFull();
  return SendResult::queueFull;
}

SendResult RequestSender::send(Message& message, Deadline takeBefore, std::uint32_t* requestId,
                               Retry retry) noexcept {
  if (!message) return SendResult::empty;
  if (retry != Retry::never) return sendWithCopy(message, nsOf(takeBefore), requestId);
  std::uint32_t id = 0;
  const auto result = sendInTurn(message, nsOf(takeBefore), id, nullptr, Turn::last);
  if (requestId != nullptr && result == SendResult::sent) *requestId = id;
  return result;
}

SendResult RequestSender::sendAs(std::uint32_t requestId, Message& message,
                                 Deadline takeBefore) noexcept {
  if (!message) return SendResult::empty;
  return sendOutOfLine(message, nsOf(takeBefore), requestId, nullptr, Turn::last);
}

std::size_t RequestSender::sendAs(const MessageRun& run) noexcept {
  // One attempt: the rest is sent one by one.
  const auto sendAll = [&](std::size_t) {
    return SentMany{sendRunLocked(run), SendResult::queueFull};
  };
  return sendInBatch(run.size(), 0, sendAll).count;
}

SendResult RequestSender::sendWithCopy(Message& message, std::int64_t deadlineNs,
                                       std::uint32_t* requestId) noexcept {
  auto copy = tryCopy(message);
  if (!copy) return SendResult::noMemory;
  std::uint32_t id = 0;
  const auto result = sendOutOfLine(message, deadlineNs, id, &copy, Turn::last);
  if (requestId != nullptr && result == SendResult::sent) *requestId = id;
  return result;
}

[[gnu::noinline]] SendResult RequestSender::sendOutOfLine(Message& message, std::int64_t deadlineNs,
                                                          std::uint32_t& requestId,
                                                          std::unique_ptr<Message>* copy,
                                                          Turn turn) noexcept {
  return sendInTurn(message, deadlineNs, requestId, copy, turn);
}

[[gnu::always_inline]] inline SendResult RequestSender::sendInTurn(Message& message,
                                                                   std::int64_t deadlineNs,
                                                                   std::uint32_t& requestId,
                                                                   std::unique_ptr<Message>* copy,
                                                                   Turn turn) noexcept {
  bool startsNudging = false;
  {
    const BiasedLock::Guard lock(*lock_);
    if (turn == Turn::last && !untaken_.isEmpty()) return refuseBehindUntaken();
    const auto result = trySendLocked(message, deadlineNs, requestId, copy);
    if (result != SendResult::sent) return result;
    if (turn == Turn::firstUntaken) untaken_.removeFront();
    startsNudging = !std::exchange(isNudging_, true);
  }
  message.reset();
  setTimers(startsNudging, deadlineNs);
  return SendResult::sent;
}

template <class SendNext>
SentMany RequestSender::sendInBatch(std::size_t count, std::int64_t deadlineNs,
                                    const SendNext& sendNext) noexcept {
  SentMany sent;
  bool startsNudging = false;
  {
    const BiasedLock::Guard lock(*lock_);
    if (!untaken_.isEmpty()) return {0, refuseBehindUntaken()};
    if (state_.load(std::memory_order_relaxed) != BindingState::connected)
      return {0, SendResult::notConnected};
    const Link::Batch batch(channel_->link());
    while (sent.count < count && sent.result == SendResult::sent) {
      const SentMany next = sendNext(sent.count);
      sent = {sent.count + next.count, next.result};
    }
    if (sent.count != 0) startsNudging = !std::exchange(isNudging_, true);
  }
  if (sent.count != 0) setTimers(startsNudging, deadlineNs);
  return sent;
}

SentMany RequestSender::sendMany(std::span<Message> messages, Deadline takeBefore,
                                 std::span<std::uint32_t> requestIds) noexcept {
  const auto deadlineNs = nsOf(takeBefore);
  const auto sent = sendInBatch(messages.size(), deadlineNs, [&](std::size_t index) -> SentMany {
    auto& message = messages[index];
    std::uint32_t id = 0;
    const auto result =
        message ? trySendLocked(message, deadlineNs, id, nullptr) : SendResult::empty;
    if (result != SendResult::sent) return {0, result};
    if (index < requestIds.size()) requestIds[index] = id;
    return {1, result};
  });
  for (auto& message : messages.first(sent.count)) message.reset();
  return sent;
}

SentMany RequestSender::sendBodies(const Bodies& bodies, Deadline takeBefore,
                                   std::span<std::uint32_t> requestIds) noexcept {
  const auto deadlineNs = nsOf(takeBefore);
  return sendInBatch(bodies.count(), deadlineNs, [&](std::size_t index) {
    const auto ids = requestIds.subspan(std::min(index, requestIds.size()));
    return sendNextLocked(bodies.from(index), deadlineNs, ids);
  });
}

// Sends as many as fit, or the first one as a message: if it is refused, the result says why.
SentMany RequestSender::sendNextLocked(const Bodies& bodies, std::int64_t deadlineNs,
                                       std::span<std::uint32_t> requestIds) noexcept {
  if (const auto count = sendRunLocked(bodies, deadlineNs, requestIds); count != 0)
    return {count, SendResult::sent};
  auto message = Message::copyInline(bodies.type, bodies.first(1).all);
  std::uint32_t id = 0;
  const auto result = trySendLocked(message, deadlineNs, id, nullptr);
  if (result != SendResult::sent) return {0, result};
  if (!requestIds.empty()) requestIds.front() = id;
  return {1, result};
}

// Returns 0 if there is no room now, and for bodies that do not fill a slot.
std::size_t RequestSender::sendRunLocked(const Bodies& bodies, std::int64_t deadlineNs,
                                         std::span<std::uint32_t> requestIds) noexcept {
  auto& link = channel_->link();
  if (!bodies.fillSlots() || bodies.size > link.maxMessageBytes()) return 0;
  const auto most = std::min<std::size_t>(bodies.count(), requests_->room());
  const auto words = [&](std::size_t index, std::int64_t sentNs) {
    std::uint32_t id = 0;
    auto& request = *requests_->tryReserve(id);
    request.clientType = 0;
    request.clientExtra = 0;
    request.setOrdinal(link.outgoing().messages() + 1);
    request.deadlineNs = deadlineNs;
    request.sentNs = sentNs;
    requests_->add(request, id);
    MPF_STEP(request_added);
    if (index < requestIds.size()) requestIds[index] = id;
    return EnvelopeWords::of({.type = static_cast<std::uint16_t>(bodies.type),
                              .requestId = id,
                              .sentTick = Tick::ofSample(sentNs),
                              .timeNs = deadlineNs},
                             1, layout::kFirstSlotBodyBytes);
  };
  const auto count = link.trySendRun(words, bodies.first(most).all, {link.header().queueSize, 0});
  if (count == 0) return 0;
  isFullReported_ = false;
  showSent(link);
  return count;
}

// Sends the first requests of `run`, as many as there is room for, under their own numbers. All are
// added to the table before: `words` cannot refuse, but the place of a number may be in use.
std::size_t RequestSender::sendRunLocked(const MessageRun& run) noexcept {
  auto& link = channel_->link();
  if (link.maxMessageBytes() < layout::kFirstSlotBodyBytes) return 0;
  std::array<Request*, MessageRun::kMost> added;
  std::size_t count = 0;
  while (count < run.size()) {
    auto id = run[count].requestId();
    auto* const request = requests_->tryReserve(id);
    if (request == nullptr) break;
    request->clientType = run[count].clientType();
    request->clientExtra = run[count].clientExtra();
    request->setOrdinal(link.outgoing().messages() + 1 + count);
    request->deadlineNs = 0;
    request->sentNs = 0;
    requests_->add(*request, id);
    added[count++] = request;
  }
  MPF_STEP(request_added);
  std::size_t sent = 0;
  const auto body = EnvelopeWords::fullSlot(static_cast<std::uint16_t>(run.type()), 0);
  const auto words = [&](std::size_t index, std::int64_t sentNs) {
    if (index == 0) added[sent]->sentNs = sentNs;
    const auto& given = run[sent + index];
    return EnvelopeWords{body, given.request, given.clientWith(Tick::ofSample(sentNs)), 0};
  };
  while (sent < count) {
    const auto rest = run.values(sent, count - sent);
    const auto next = link.trySendRun(words, rest, {link.header().queueSize, 0});
    if (next == 0) break;
    showSent(link);
    sent += next;
  }
  for (auto at = sent; at < count; ++at) static_cast<void>(requests_->takeBack(*added[at]));
  if (sent != 0) isFullReported_ = false;
  return sent;
}

// Without the lock, after messages were sent.
inline void RequestSender::setTimers(bool startsNudging, std::int64_t deadlineNs) noexcept {
  MPF_STEP(request_sent);
  if (startsNudging) timer_.wakeAt(Clock::nowNs() + NudgeInterval::kFirstNs);
  if (deadlineNs != 0) timer_.wakeAt(deadlineNs);
}

bool RequestSender::tryKeep(Request& request) noexcept {
  if (!request.copy || request.isGivenUp) return false;
  {
    const BiasedLock::Guard lock(*lock_);
    if (!untaken_.tryAdd(request)) return false;
  }
  requests_->end(request);
  return true;
}

SendResult RequestSender::trySendUntaken() noexcept {
  auto& next = untaken_.front();
  const auto message = tryCopy(*next.message);
  if (!message) return SendResult::noMemory;
  return sendOutOfLine(*message, next.deadlineNs, next.id, &next.message, Turn::firstUntaken);
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
  auto body = [&] {
    const BiasedLock::Guard lock(*lock_);
    return channel_ ? channel_->tryAllocateLocked(bytes) : BodyBytes{};
  }();
  if (body.data == nullptr) body = allocateHeapBody(bytes);
  return body;
}

std::uint64_t RequestSender::maxMessageBytes() const noexcept {
  const BiasedLock::Guard lock(*lock_);
  return state_.load(std::memory_order_relaxed) == BindingState::connected
             ? channel_->link().maxMessageBytes()
             : 0;
}

void RequestSender::open(std::shared_ptr<MessageLink> channel) {
  auto requests = std::make_shared<RequestTable>(channel->link().maxOutstanding(),
                                                 requests_ ? requests_->lastId() : 0);
  const BiasedLock::Guard lock(*lock_);
  requests_ = std::move(requests);
  channel_.swap(channel);
  isFullReported_ = false;
  isNudging_ = true;
}

void RequestSender::close() noexcept {
  std::shared_ptr<MessageLink> ended;  // destroyed after the guard
  const BiasedLock::Guard lock(*lock_);
  ended = std::move(channel_);
}

// Under the lock: a request that is being sent may yet be taken back.
std::uint32_t RequestSender::findExpired(std::uint32_t& at, std::int64_t nowNs,
                                         std::int64_t& nextNs) noexcept {
  const BiasedLock::Guard lock(*lock_);
  while (const auto* const request = requests_->next(at)) {
    if (request->deadlineNs == 0 || request->isGivenUp) continue;
    if (request->deadlineNs > nowNs) {
      nextNs = std::min(nextNs, request->deadlineNs);
    } else if (!channel_->link().outgoing().isTaken(request->ordinal())) {
      return request->id.load(std::memory_order_relaxed);
    }
  }
  return 0;
}

bool RequestSender::tryEndNudging() noexcept {
  const BiasedLock::Guard lock(*lock_);
  if (requests_->awaited() != 0) return false;
  isNudging_ = false;
  return true;
}

}  // namespace mpf
