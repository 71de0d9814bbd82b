// SPDX-License-Identifier: MIT
// Binding: takes the messages of the server and delivers them.
#include "base/step.h"
#include "client/binding.h"
#include "shm/histogram.h"

namespace mpf {
namespace {

constexpr bool isControl(MessageType type) noexcept {
  return type == MessageType::connect || type == MessageType::requestFate;
}

// A server may send a ConnectMessage only to report a full queue behind it (a router does), not as
// a reply; and a fate only as the reply to the request that it names.
bool mayServerSend(const Message& message, const Request* request) noexcept {
  if (const auto* connect = message.tryAs<Connect>())
    return request == nullptr && connect->status == ConnectStatus::connectQueueFull;
  if (message.getType() != MessageType::requestFate) return true;
  const auto* fate = message.tryAs<RequestFate>();
  return fate != nullptr && request != nullptr &&
         fate->requestId == request->id.load(std::memory_order_relaxed);
}

}  // namespace

// A change of state that comes with messages has a hint of its own, or is found when the endpoint
// stops polling the link.
bool Binding::takeSome(int most) {
  int taken = 0;
  for (; taken < most && isLinked() && !isPaused_; ++taken) {
    const auto result = takeOne();
    if (result == Taken::nothing) break;
    if (result == Taken::message) continue;
    count(control().protocolErrors);
    disconnect("the server sent invalid data", Ending::protocolError);
  }
  return taken != 0 || (isLinked() && !isPaused_ && onLinkState());
}

// Returns false on a protocol error; then it has delivered nothing.
[[gnu::always_inline]] inline bool Binding::tryDeliverReply(const Envelope& envelope) {
  count(control().received);
  auto& requests = *sender_.requests();
  Request* request = nullptr;
  if ((envelope.flags & layout::kSlotFirstReply) != 0) {
    request = requests.find(envelope.requestId);
    if (request == nullptr || request->isGivenUp) {
      channel().discard(envelope);
      if (request != nullptr) requests.end(*request);
      return true;
    }
  }
  Message message;
  if (const auto finish = channel().tryFinish(envelope, message);
      finish != MessageLink::Finish::message) {
    if (finish == MessageLink::Finish::invalid) return false;
    if (request != nullptr) deliverFate(*request, Fate::outcomeUnknown);
    return true;
  }
  if (isControl(message.getType())) {
    const auto control = prepareControl(message, request);
    if (control != Control::deliver) return control == Control::keep;
  }
  if (envelope.sentTick != 0 || (request != nullptr && request->sentNs != 0))
    noteTimes(envelope, request);
  const auto missed = Message::missedFlags(message.getMissed());
  message.setRoute(
      {0, envelope.requestId, missed | (request != nullptr ? kEndsRequest : 0), nullptr});
  message.setTimeStampNs(envelope.timeNs);
  if (request != nullptr) {
    requests.end(*request);
    MPF_STEP(request_ended);
    channel().link().control().clientUnanswered.store(requests.awaited(),
                                                      std::memory_order_relaxed);
  }
  deliver(std::move(message));
  return true;
}

Binding::Taken Binding::takeOne() {
  Envelope envelope;
  const auto take = channel().tryBegin(envelope);
  if (take == MessageLink::Take::nothing) return Taken::nothing;
  return take == MessageLink::Take::message && tryDeliverReply(envelope) ? Taken::message
                                                                         : Taken::invalid;
}

// A ConnectMessage or a fate that the server has sent. `keep`: the request was kept, to be sent
// again.
Binding::Control Binding::prepareControl(Message& message, Request* request) {
  if (!mayServerSend(message, request)) return Control::invalid;
  if (auto* connect = message.tryAs<Connect>()) connect->incarnation = connector_.incarnation();
  const auto* fate = message.tryAs<RequestFate>();
  if (fate == nullptr) return Control::deliver;
  // A router reports that the server behind it has not taken the request.
  if (fate->fate == Fate::neverTaken && sender_.tryKeep(*request)) {
    timer_.wakeAt(Clock::nowNs() + kSendUntakenAfterNs);
    return Control::keep;
  }
  // The server sends fates without the marks of the client.
  message.setClientType(request->clientType);
  message.setClientExtra(request->clientExtra);
  return Control::deliver;
}

void Binding::noteTimes(Envelope envelope, const Request* request) noexcept {
  auto& endpoint = parts_.endpoint;
  const auto nowNs = Clock::nowNs();
  if (request != nullptr && request->sentNs != 0)
    record(endpoint.control().serviceNs, nowNs - request->sentNs);
  if (envelope.sentTick == 0) return;
  const auto waitedNs = Tick::nsSince(envelope.sentTick, nowNs);
  record(endpoint.control().queueWaitNs, waitedNs);
  if (endpoint.slept()) endpoint.noteWake(waitedNs);
}

// The callback may throw: callers have finished all other work on the message before.
void Binding::deliver(Message&& message) try {
  if (!hasLeft()) callback_(std::move(message));
} catch (...) {
  parts_.errors.note(connector_.server(), connector_.location());
  throw;
}

}  // namespace mpf
