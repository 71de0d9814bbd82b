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

// News of the connection is ours to tell, but for a queue that is full somewhere behind the server,
// and a fate is the end of the request that it names.
bool isForServersToSend(const Message& message, const Request* request) noexcept {
  if (const auto* news = message.tryAs<Connect>())
    return request == nullptr && news->status == ConnectStatus::connectQueueFull;
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

std::string Binding::notConnectedBecause() const {
  if (isConnected()) return {};
  const std::lock_guard lock(reasonMutex_);
  return reason_;
}

void Binding::setReason(const std::string& reason) {
  const std::lock_guard lock(reasonMutex_);
  reason_ = reason;
}

bool Binding::waitConnected(Deadline deadline) {
  std::unique_lock lock(reasonMutex_);
  const auto connected = [this] { return isConnected(); };
  if (deadline.isNever()) {
    connectedChanged_.wait(lock, connected);
    return true;
  }
  return connectedChanged_.wait_for(lock, deadline.left(), connected);
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
  disconnect("the server sent nonsense", Ending::protocolError);
  return true;
}

// True when the state of the link was news.
bool Binding::onLinkState() {
  auto& link = channel_->link();
  const auto state = link.peerState();
  if (link.isLost() || link.peer()->isLost()) {
    count(dispatcher_.endpoint().control().protocolErrors);
    disconnect("somebody cut the connection's shared memory", Ending::protocolError);
    return true;
  }
  if (state == layout::LinkState::open && !isConnected()) {
    link.setPeerIndex(link.control().serverIndex.load(std::memory_order_relaxed) %
                      layout::kMaxLinks);
    {
      const std::lock_guard lock(*lock_);
      fullTold_ = false;
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
  if (state == layout::LinkState::closed && !link.hasMessage()) {
    disconnect("the server closed the connection", Ending::serverGone);
    return true;
  }
  if (state == layout::LinkState::refused) {
    disconnect("the server has no room for another client", Ending::refused);
    deliverConnect(ConnectStatus::connectRefused);
    return true;
  }
  return false;
}

// False: nonsense, of which nothing was delivered.
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
  if (!isForServersToSend(message, request)) return false;
  if (envelope.sentTick != 0 || (request != nullptr && request->sentNs != 0))
    noteTimes(envelope, request);
  message.setRoute({0, envelope.requestId, request != nullptr ? kEndsRequest : 0, nullptr});
  if (auto* news = message.tryAs<Connect>()) news->incarnation = incarnation_;
  if (request != nullptr) {
    // A fate that the server sent without knowing them.
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

// Before it is called all of the message's state is as it is to be after it: it may throw.
void Binding::deliver(Message&& message) try {
  if (!left_) callback_(std::move(message));
} catch (...) {
  dispatcher_.noteThrower(server_, location_);
  throw;
}

void Binding::deliverConnect(ConnectStatus status) {
  deliver(ConnectMessage({.status = status, .incarnation = incarnation_}));
}

// A request that the server may still reply to keeps its entry until it has.
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

// What a server sent before it went. One that is not gone may send for ever: what fits its ring is
// all that it had sent.
void Binding::deliverTheRest(const MessageLink* channel) {
  Envelope envelope;
  while (channel_.get() == channel && end_->restSlots != 0) {
    --end_->restSlots;
    if (channel_->tryBegin(envelope) == MessageLink::Take::message && tryDeliverReply(envelope))
      continue;
    end_->restSlots = 0;
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

// A callback that throws has had its message; onTime() comes back for what is left.
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
  deliverTheRest(channel.get());
  requests->forEach([&](Request& request) {
    deliverFate(request,
                ending != Ending::protocolError && !channel->link().isTaken(request.ordinal)
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
  // It may have accepted us without our having looked since.
  if (link.peerState() == layout::LinkState::open)
    link.setPeerIndex(link.control().serverIndex.load(std::memory_order_relaxed) %
                      layout::kMaxLinks);
  if (!serverDied) link.notifyPeer();
  removeBulk(endpoint.backplane().name(), link.header().incarnation);
  MPF_STEP(bulk_removed);
  segments::remove(link.name());
  resume();  // a callback may have paused us anew
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
  if (channel_) disconnect("the client ended", Ending::serverGone);
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
  // PAIR(due): a sender that lowers it from now on wakes us again.
  doorbell::fence();
  const auto self = shared_from_this();
  try {
    expire(nowNs);
    if (channel_) nudge(nowNs);
  } catch (...) {
    wakeAt(nowNs);  // for the other requests
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
      taken = channel_->link().isTaken(request.ordinal);
    }
    if (!taken) deliverFate(request, Fate::expired);
  });
}

// Hints may be lost to somebody who scribbles over them: while something is owed to us, ring again
// now and then.
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
      return disconnect("the server ended before it had accepted the client", Ending::serverGone);
    } else {
      link.peer()->knock(link.header().incarnation);
      setReason(notAcceptedBecause(*link.peer()));
      if (dispatcher_.endpoint().window().isNameless())
        setReason(
            "somebody removed this process's files from /dev/shm (RemoveIPC of systemd-logind?): "
            "no server finds it until it starts again");
    }
    takeOne();  // a reply, or what the server says of the link: we may not have been told
  }
  wakeAt(knockedNs_ + nudgeEveryNs_);
}

// True when nothing is owed to us: the next send() begins anew.
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
  // PAIR(due): our time before, the dispatcher's after.
  doorbell::fence();
  dispatcher_.noteDue(ns);
}

void Binding::tellQueueFull() {
  if (channel_ && isConnected()) deliverConnect(ConnectStatus::connectQueueFull);
}

}  // namespace mpf
