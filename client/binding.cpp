// SPDX-License-Identifier: MIT
#include "client/binding.h"

#include <fmt/format.h>
#include <mutex>

#include "base/step.h"
#include "client/dispatcher_impl.h"
#include "shm/histogram.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

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

std::uint64_t Binding::maxMessageBytes() const noexcept {
  const std::lock_guard lock(*lock_);
  return isConnected() ? channel_->link().maxMessageBytes() : 0;
}

bool Binding::takeOne() {
  if (!channel_ || paused_ || end_) return false;
  Envelope envelope;
  switch (channel_->tryBegin(envelope)) {
    case MessageLink::Take::nothing:
      return onLinkState();
    case MessageLink::Take::message:
      if (tryDeliverReply(envelope)) return true;
      break;
    case MessageLink::Take::invalid:
      break;
  }
  count(dispatcher_.endpoint().control().protocolErrors);
  disconnect("the server sent invalid data", Ending::protocolError);
  return true;
}

// Acts on a change of the state of the link. Returns false when there was none.
bool Binding::onLinkState() {
  auto& link = channel_->link();
  const auto state = link.peerState();
  if (link.isLost() || link.peer()->isLost()) {
    count(dispatcher_.endpoint().control().protocolErrors);
    disconnect("the shared memory of the connection was truncated", Ending::protocolError);
    return true;
  }
  if (state == layout::LinkState::open && !isConnected()) {
    link.setPeerIndex(link.control().serverIndex.load(std::memory_order_relaxed) %
                      layout::kMaxLinks);
    {
      const std::lock_guard lock(*lock_);
      isFullReported_ = false;
      connected_.store(true, std::memory_order_relaxed);
    }
    MPF_STEP(connected);
    {
      const std::lock_guard lock(reasonMutex_);
      connectedChanged_.notify_all();
    }
    count(dispatcher_.endpoint().control().linksOpened);
    deliverConnect(ConnectStatus::connectYes);
    return true;
  }
  if (state == layout::LinkState::closed && !link.incoming().hasMessage()) {
    disconnect("the server closed the connection", Ending::serverGone);
    return true;
  }
  if (state == layout::LinkState::refused) {
    disconnect("the server has its maximum number of clients", Ending::refused);
    deliverConnect(ConnectStatus::connectRefused);
    return true;
  }
  return false;
}

// Returns false on a protocol error; then it has delivered nothing.
bool Binding::tryDeliverReply(const Envelope& envelope) {
  auto& control = dispatcher_.endpoint().control();
  count(control.received);
  auto* request = (envelope.flags & layout::kSlotFirstReply) != 0
                      ? requests_->find(envelope.requestId)
                      : nullptr;
  if ((envelope.flags & layout::kSlotFirstReply) != 0 &&
      (request == nullptr || request->isGivenUp)) {
    channel_->discard(envelope);
    if (request != nullptr) requests_->end(*request);
    return true;
  }
  Message message;
  switch (channel_->tryFinish(envelope, message)) {
    case MessageLink::Finish::invalid:
      return false;
    case MessageLink::Finish::unavailable:
      if (request != nullptr) deliverFate(*request, Fate::outcomeUnknown);
      return true;
    case MessageLink::Finish::message:
      break;
  }
  if (!mayServerSend(message, request)) return false;
  if (envelope.sentTick != 0 || (request != nullptr && request->sentNs != 0))
    noteTimes(envelope, request);
  message.setRoute({0, envelope.requestId, request != nullptr ? kEndsRequest : 0, nullptr});
  if (auto* connect = message.tryAs<Connect>()) connect->incarnation = incarnation_;
  if (request != nullptr) {
    // The server sends fates without the marks of the client.
    if (message.getType() == MessageType::requestFate) {
      message.setClientType(request->clientType);
      message.setClientExtra(request->clientExtra);
    }
    requests_->end(*request);
    MPF_STEP(request_ended);
    channel_->link().control().clientUnanswered.store(requests_->awaited(),
                                                      std::memory_order_relaxed);
  }
  deliver(std::move(message));
  return true;
}

void Binding::noteTimes(const Envelope& envelope, const Request* request) noexcept {
  auto& endpoint = dispatcher_.endpoint();
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
  if (!left_) callback_(std::move(message));
} catch (...) {
  dispatcher_.noteThrower(server_, location_);
  throw;
}

void Binding::deliverConnect(ConnectStatus status) {
  deliver(ConnectMessage({.status = status, .incarnation = incarnation_}));
}

// A cancelled or expired request keeps its entry until the server replies to it or refuses it.
void Binding::deliverFate(Request& request, Fate fate) {
  if (request.isGivenUp) return;
  RequestFateMessage message(
      {.fate = fate, .requestId = request.id.load(std::memory_order_relaxed)});
  message.setClientType(request.clientType);
  message.setClientExtra(request.clientExtra);
  message.setRoute({0, message->requestId, kEndsRequest, nullptr});
  if (fate == Fate::cancelled || fate == Fate::expired) {
    requests_->giveUp(request);
  } else {
    requests_->end(request);
  }
  MPF_STEP(fate_given);
  deliver(std::move(message));
}

bool Binding::hasDeadPeer() const noexcept {
  return channel_ && !end_ && channel_->link().peer()->isDead();
}

// Delivers the messages that the server sent before it closed the link or died. A server that is
// still alive could send without end, so at most one ring of messages is delivered.
void Binding::deliverRemaining(const MessageLink* channel) {
  Envelope envelope;
  while (channel_.get() == channel && end_->remainingSlots != 0) {
    --end_->remainingSlots;
    if (channel_->tryBegin(envelope) == MessageLink::Take::message && tryDeliverReply(envelope))
      continue;
    end_->remainingSlots = 0;
  }
}

void Binding::disconnect(const std::string& reason, Ending ending) {
  bool wasConnected = false;
  {
    const std::lock_guard lock(*lock_);
    wasConnected = connected_.exchange(false, std::memory_order_relaxed);
  }
  MPF_STEP(disconnecting);
  setReason(reason);
  resume();
  end_ = {ending, wasConnected,
          ending == Ending::serverGone ? channel_->link().header().replySlots : 0};
  resumeEnd();
}

// When a callback throws, its message counts as delivered, and onTime() continues the rest.
void Binding::resumeEnd() {
  const auto self = shared_from_this();
  try {
    endAll();
  } catch (...) {
    if (end_) {
      end_->isInterrupted = true;
      wakeAt(Clock::nowNs());
    }
    throw;
  }
}

void Binding::endAll() {
  const auto channel = channel_;
  const auto requests = requests_;
  const auto ending = end_->ending;
  end_->isInterrupted = false;
  deliverRemaining(channel.get());
  requests->forEach([&](Request& request) {
    deliverFate(request, ending != Ending::protocolError &&
                                 !channel->link().outgoing().isTaken(request.ordinal)
                             ? Fate::neverTaken
                             : Fate::outcomeUnknown);
  });
  if (channel_ != channel) return;  // a callback destroyed the client
  const bool wasConnected = end_->wasConnected;
  closeChannel();
  end_.reset();
  try {
    if (wasConnected) deliverConnect(ConnectStatus::connectNo);
  } catch (...) {
    lookForServer(ending);
    throw;
  }
  lookForServer(ending);
}

void Binding::closeChannel() {
  auto& link = channel_->link();
  auto& endpoint = dispatcher_.endpoint();
  MPF_STEP(requests_ended);
  const bool serverDied = link.peer()->isDead();
  if (serverDied) count(endpoint.control().peersDied);
  link.setState(layout::LinkState::closed);
  // The server may have accepted the link after the last look at its state.
  if (link.peerState() == layout::LinkState::open)
    link.setPeerIndex(link.control().serverIndex.load(std::memory_order_relaxed) %
                      layout::kMaxLinks);
  if (!serverDied) link.notifyPeer();
  removeBulk(endpoint.backplane().name(), link.header().incarnation);
  MPF_STEP(bulk_removed);
  segments::remove(link.name());
  resume();  // a callback may have called pause() again
  endpoint.detach(index_);
  dispatcher_.setLink(index_, nullptr);
  count(endpoint.control().linksClosed);
  const std::lock_guard lock(*lock_);
  channel_.reset();
}

void Binding::lookForServer(Ending ending) {
  if (left_) return;
  if (ending == Ending::serverGone) return tryConnect();
  wakeAt(Clock::nowNs() + kRetryNs);
}

void Binding::cancel(std::uint32_t requestId) {
  if (!requests_) return;
  if (auto* request = requests_->find(requestId)) deliverFate(*request, Fate::cancelled);
}

void Binding::pause() {
  if (!channel_ || std::exchange(paused_, true)) return;
  dispatcher_.endpoint().hold(index_);
}

void Binding::resume() {
  if (std::exchange(paused_, false)) dispatcher_.endpoint().release(index_, channel_->link());
}

void Binding::leave() {
  left_ = true;
  if (channel_) disconnect("the client was destroyed", Ending::serverGone);
  if (pendingBind_) segments::remove(pendingBind_.name());
  pendingBind_ = {};
}

void Binding::onTime(std::int64_t nowNs) {
  dueNs_.store(INT64_MAX, std::memory_order_relaxed);
  if (end_) {
    if (end_->isInterrupted) resumeEnd();
    return;
  }
  if (!channel_) {
    if (isBound() && !left_) tryConnect();
    return;
  }
  // PAIR(due): a sender that lowers dueNs_ from now on wakes the dispatcher again.
  doorbell::fence();
  const auto self = shared_from_this();
  try {
    expire(nowNs);
    if (channel_) nudge(nowNs);
  } catch (...) {
    wakeAt(nowNs);  // the next call handles the other requests
    throw;
  }
}

void Binding::expire(std::int64_t nowNs) {
  const auto requests = requests_;
  const auto channel = channel_;
  requests->forEach([&](Request& request) {
    if (channel_ != channel || end_) return;  // a callback ran the dispatcher
    if (request.deadlineNs == 0 || request.isGivenUp) return;
    if (request.deadlineNs > nowNs) return wakeAt(request.deadlineNs);
    // PAIR(taken-before-clock): if the server has not counted it as taken, it will see that the
    // deadline has passed.
    doorbell::fence();
    bool taken = false;
    {
      const std::lock_guard lock(*lock_);
      taken = channel_->link().outgoing().isTaken(request.ordinal);
    }
    if (!taken) deliverFate(request, Fate::expired);
  });
}

// A faulty process may overwrite hints in shared memory. While a reply is outstanding, this rings
// the server's doorbell again from time to time.
void Binding::nudge(std::int64_t nowNs) {
  const bool connected = isConnected();
  if (connected && endNudging()) {
    nudgeEveryNs_ = kFirstNudgeNs;
    return;
  }
  if (nowNs - knockedNs_ >= nudgeEveryNs_) {
    knockedNs_ = nowNs;
    nudgeEveryNs_ = std::min(2 * nudgeEveryNs_, kLastNudgeNs);
    auto& link = channel_->link();
    link.peer()->forceNextRing();
    if (connected) {
      link.notifyPeer();
    } else if (link.peer()->isClosed()) {
      return disconnect("the server exited before it accepted the client", Ending::serverGone);
    } else {
      link.peer()->knock(link.header().incarnation);
      setReason(notAcceptedBecause(*link.peer()));
      if (dispatcher_.endpoint().window().isNameless())
        setReason(
            "the files of this process in /dev/shm were removed (by RemoveIPC of systemd-logind?), "
            "so no server can find this client: restart this process");
    }
    takeOne();  // a reply or a change of the link whose hint was lost
  }
  wakeAt(knockedNs_ + nudgeEveryNs_);
}

// Returns true when no reply is outstanding; the next send() then starts the nudging again.
bool Binding::endNudging() {
  const std::lock_guard lock(*lock_);
  if (requests_->awaited() != 0) return false;
  nudging_ = false;
  return true;
}

void Binding::wakeAt(std::int64_t ns) noexcept {
  auto due = dueNs_.load(std::memory_order_relaxed);
  while (ns < due && !dueNs_.compare_exchange_weak(due, ns, std::memory_order_relaxed)) {
  }
  // PAIR(due): dueNs_ of this binding is stored before that of the dispatcher is read.
  doorbell::fence();
  dispatcher_.noteDue(ns);
}

void Binding::reportQueueFull() {
  if (channel_ && isConnected()) deliverConnect(ConnectStatus::connectQueueFull);
}

}  // namespace mpf
