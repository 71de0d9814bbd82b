// SPDX-License-Identifier: MIT
// Binding: takes the messages of the server and delivers them.
#include <algorithm>
#include <array>
#include <cstring>

#include "base/step.h"
#include "client/binding.h"
#include "shm/histogram.h"
#include "shm/messages/message_run.h"

namespace mpf {
namespace {

constexpr bool isControl(MessageType type) noexcept {
  return type == MessageType::connect || type == MessageType::requestFate;
}

// A server may send a ConnectMessage only to report a full queue behind it (a router does), not as
// a reply; and a fate only as the reply to the request that it names. Both are short: a longer one
// may be in shared memory, where the server could change it after the check.
bool mayServerSend(const Message& message, const Request* request) noexcept {
  if (!message.isInline()) return false;
  if (message.getType() == MessageType::connect) {
    const auto* connect = message.tryAs<Connect>();
    return connect != nullptr && request == nullptr &&
           connect->status == ConnectStatus::connectQueueFull;
  }
  const auto* fate = message.tryAs<RequestFate>();
  return fate != nullptr && request != nullptr &&
         fate->requestId == request->id.load(std::memory_order_relaxed);
}

// The envelope of the messages that are like `first` and fill a slot.
EnvelopeWords wordsOf(const Message& first, std::uint8_t flags) noexcept {
  return EnvelopeWords::of({.type = static_cast<std::uint16_t>(first.getType()),
                            .flags = flags,
                            .requestId = first.route().requestId,
                            .clientType = first.getClientType(),
                            .clientExtra = first.getClientExtra(),
                            .timeNs = first.getTimeStampNs()},
                           1, layout::kFirstSlotBodyBytes);
}

}  // namespace

// A change of state that comes with messages has a hint of its own, or is found when the endpoint
// stops polling the link.
bool Binding::takeSome(int most) {
  int taken = 0;
  for (; taken < most && isLinked() && !isPaused_ && channel().hasMessage(); ++taken) {
    if (tryTakeOne()) {
      if (takenBehind_ != 0) taken += std::exchange(takenBehind_, 0);
      continue;
    }
    count(control().protocolErrors);
    disconnect("the server sent invalid data", Ending::protocolError);
  }
  return taken != 0 || (isLinked() && !isPaused_ && onLinkState());
}

// Delivers the messages that the server sent before it closed the link or died. A server that is
// still alive could send without end, so this ends after as many messages, or runs of values, as
// the rings have slots.
void Binding::deliverRemaining(const MessageLink* ended) {
  while (sender_.channel().get() == ended && end_.remainingSlots != 0) {
    --end_.remainingSlots;
    if (!channel().hasMessage() || !tryTakeOne()) end_.remainingSlots = 0;
  }
}

// Inline, so that takeSome() is one function up to the callback.
[[gnu::always_inline]] inline bool Binding::tryTakeOne() {
  auto& channel = this->channel();
  Envelope envelope;
  if (!channel.tryBegin(envelope)) return false;
  count(control().received);
  Request* request = nullptr;
  if ((envelope.flags & layout::kSlotFirstReply) != 0) {
    request = sender_.requests()->find(envelope.requestId);
    if (request == nullptr || request->isGivenUp) {
      dropReply(envelope.body(), request);
      return true;
    }
    if (!isSent(*request)) return false;
  } else if (runs_ != nullptr && isAwaited(envelope.requestId)) {
    // The other router would treat this reply as a protocol error of this router.
    return false;
  }
  if (!MessageLink::isShort(envelope.body())) {
    return tryTakeLong(envelope.body(), envelope.marks(), {envelope.sentTick, envelope.timeNs},
                       request);
  }
  const Route route{0, envelope.requestId, request != nullptr ? kEndsRequest : 0, nullptr};
  auto message = channel.finishShort(envelope, route, envelope.timeNs);
  return tryDeliver(std::move(message), envelope.sentTick, request);
}

bool Binding::tryTakeLong(BodyFields fields, RequestMarks marks, Times times, Request* request) {
  const Route route{0, marks.requestId, request != nullptr ? kEndsRequest : 0, nullptr};
  MessageLink::Finish finish{};
  auto message = channel().finishLong(
      fields, {route, marks.clientType(), marks.clientExtra(), times.timeNs}, finish);
  switch (finish) {
    case MessageLink::Finish::invalid:
      return false;
    case MessageLink::Finish::unavailable:
      if (request != nullptr) deliverFate(*request, Fate::outcomeUnknown);
      return true;
    case MessageLink::Finish::message:
      break;
  }
  return tryDeliver(std::move(message), times.sentTick, request);
}

// The number of messages did not include the request: waits until the thread that has the lock has
// sent it or taken it back.
[[gnu::noinline]] bool Binding::isSentAtLast(const Request& request) noexcept {
  const auto id = request.id.load(std::memory_order_relaxed);
  const BiasedLock::Guard lock(*sender_.lock());
  sentSeen_ = channel().link().outgoing().messages();
  return id != 0 && request.id.load(std::memory_order_relaxed) == id &&
         request.ordinal() <= sentSeen_;
}

// A reply to a request that has had its fate.
void Binding::dropReply(BodyFields fields, Request* request) {
  channel().discard(fields);
  if (request != nullptr) sender_.requests()->end(*request);
}

// Delivers a message, which ends `request` unless it is null. Returns false on a protocol error;
// then it has delivered nothing.
[[gnu::always_inline]] inline bool Binding::tryDeliver(Message&& message, std::uint32_t sentTick,
                                                       Request* request) {
  if (isControl(message.getType())) {
    const auto control = prepareControl(message, request);
    if (control != Control::deliver) return control == Control::keep;
  }
  if (sentTick != 0 || (request != nullptr && request->sentNs != 0)) noteTimes(sentTick, request);
  if (request != nullptr) endRequest(*request);
  deliver(std::move(message));
  return true;
}

[[gnu::always_inline]] inline void Binding::endRequest(Request& request) {
  sender_.requests()->end(request);
  MPF_STEP(request_ended);
  showAnswered();
}

// A ConnectMessage or a fate that the server has sent. `keep`: the request was kept, to be sent
// again.
Binding::Control Binding::prepareControl(Message& message, Request* request) {
  if (!mayServerSend(message, request)) return Control::invalid;
  if (auto* connect = message.tryAs<Connect>()) connect->incarnation = connector_.incarnation();
  const auto* fate = message.tryAs<RequestFate>();
  if (fate == nullptr || request == nullptr) return Control::deliver;  // only a fate has one
  // A router reports that the server behind it has not taken the request.
  if (fate->fate == Fate::neverTaken && sender_.tryKeep(*request)) {
    showAnswered();
    timer_.wakeAt(Clock::nowNs() + kSendUntakenAfterNs);
    return Control::keep;
  }
  // The server sends fates without the marks of the client.
  message.setClientType(request->clientType);
  message.setClientExtra(request->clientExtra);
  return Control::deliver;
}

void Binding::noteTimes(std::uint32_t sentTick, const Request* request) noexcept {
  auto& endpoint = parts_.endpoint;
  const auto nowNs = Clock::nowNs();
  if (request != nullptr && request->sentNs != 0)
    record(endpoint.control().serviceNs, nowNs - request->sentNs);
  if (sentTick == 0) return;
  const auto waitedNs = Tick::nsSince(sentTick, nowNs);
  record(endpoint.control().queueWaitNs, waitedNs);
  if (endpoint.slept()) endpoint.noteWake(waitedNs);
}

// The callback may throw: callers have finished all other work on the message before.
void Binding::deliver(Message&& message) try {
  if (hasLeft()) return;
  if (message.getType() == values_.type && message.isSound()) {
    deliverValues(message);
  } else if (runs_ == nullptr || !tryDeliverRun(message)) {
    callback_(std::move(message));
  }
} catch (...) {
  parts_.errors.note(connector_.server(), connector_.location());
  throw;
}

// Calls the handler with the value of `first` and, if it fills a slot, with others of its run. Not
// inline, so that deliver() stays small.
[[gnu::noinline]] void Binding::deliverValues(const Message& first) {
  const auto body = first.body();
  if (body.size() != layout::kFirstSlotBodyBytes || values_.size != body.size()) {
    // A copy: a body in shared memory may change.
    alignas(8) std::array<std::byte, Message::kInlineBytes> value;
    std::memcpy(value.data(), body.data(), values_.size);
    return values_.callback(std::span(value).first(values_.size), first);
  }
  ValueRun run;
  run.add(FirstBody::of(body.data()));
  takeFurtherReplies(first, run);
  if (run.size() == 1 && (first.route().flags & kEndsRequest) != 0) takeFirstReplies(first, run);
  values_.callback(run.bytes(), first);
}

// Takes the values after `first` that are further replies to the same request.
void Binding::takeFurtherReplies(const Message& first, ValueRun& run) noexcept {
  const auto like = wordsOf(first, 0);
  takeRun(run, ValueRun::kMost, [&](const EnvelopeWords& words) {
    if (words.body != like.body || words.request != like.request || words.timeNs != like.timeNs)
      return false;
    if (words.client == like.client) [[likely]]
      return true;  // not timed
    if (words.clientWith(0) != like.client) return false;
    noteTimes(words.sentTick(), nullptr);
    return true;
  });
}

// Takes the values after `first` that are first replies to other requests, and ends these.
void Binding::takeFirstReplies(const Message& first, ValueRun& run) noexcept {
  const auto like = wordsOf(first, layout::kSlotFirstReply);
  takeRun(run, ValueRun::kMost, [&](const EnvelopeWords& words) {
    return words.body == like.body && words.hasMarksOf(like) && tryEndRequest(words);
  });
}

// Delivers `first` together with the replies behind it: each is the first reply to its request, or
// each is a further one. Returns false, and has delivered nothing, if `first` is alone.
bool Binding::tryDeliverRun(const Message& first) {
  if (!MessageRun::canHold(first.getType()) || first.body().size() != layout::kFirstSlotBodyBytes ||
      first.getMissed() != 0 || !channel().hasMessage())
    return false;
  const auto most = std::min(runs_->room(), MessageRun::kMost);
  if (most < 2) return false;
  const bool isFirst = (first.route().flags & kEndsRequest) != 0;
  MessageRun run(first.getType(), isFirst ? layout::kSlotFirstReply : std::uint8_t{0});
  run.add(wordsOf(first, 0));
  run.add(FirstBody::of(first.body().data()));
  takeRun(run, most, [&](const EnvelopeWords& words) {
    if (!run.accepts(words)) return false;
    if (isFirst ? !tryEndRequest(words) : isAwaited(words.requestId())) return false;
    if (!isFirst && words.sentTick() != 0) noteTimes(words.sentTick(), nullptr);
    run.add(words);
    return true;
  });
  if (run.size() == 1) return false;
  takenBehind_ = static_cast<int>(run.size() - 1);
  parts_.endpoint.countTurns(static_cast<std::uint32_t>(takenBehind_));
  runs_->onRun(run, isFirst);
  return true;
}

// Takes up to `most` - 1 messages after the first one of `run`, while `accept` is true.
template <class Run, class Accept>
void Binding::takeRun(Run& run, std::size_t most, const Accept& accept) noexcept {
  const auto taken = channel().link().incoming().takeRun(
      most - 1, accept, [&](std::size_t count, const auto& body) { run.add(count, body); });
  count(control().received, taken);
}

// Ends the request of a first reply that is taken in a run. Returns false if it is not pending.
bool Binding::tryEndRequest(const EnvelopeWords& reply) noexcept {
  auto* const request = sender_.requests()->find(reply.requestId());
  if (request == nullptr || request->isGivenUp || !isSent(*request)) return false;
  if (reply.sentTick() != 0 || request->sentNs != 0) noteTimes(reply.sentTick(), request);
  // Ended before the next message is looked at, which may name the same request.
  endRequest(*request);
  return true;
}

}  // namespace mpf
