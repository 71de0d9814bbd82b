// SPDX-License-Identifier: MIT
#include <mpf/client/binding.h>

#include <fmt/format.h>
#include <mutex>

#include <mpf/client/dispatcher_impl.h>
#include <mpf/shm/histogram.h>
#include <mpf/shm/segment_name.h>

namespace mpf {
namespace {

constexpr std::int64_t kRetryNs = 1'000'000'000;

}  // namespace

void Binding::setServer(const std::string& server, std::int32_t location) {
  SegmentName::checkServer(server);
  if (isBound()) throw std::logic_error(fmt::format("bind: the client is bound to server \"{}\" already", server_));
  server_ = server;
  location_ = location;
  setReason(fmt::format("server \"{}\" at location {} is not there yet", server, location));
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

void Binding::tryConnect() try {
  auto& endpoint = dispatcher_.endpoint();
  const auto& backplane = endpoint.backplane().name();
  auto server = endpoint.peer(SegmentName::serverWindow(backplane, location_, server_), layout::SegmentKind::serverWindow);
  if (!server) return wish();
  const auto index = endpoint.tryReserve();
  if (!index) {
    setReason(fmt::format("this process has {} clients on the backplane, no more are possible", layout::kMaxLinks));
    return wakeAt(Clock::nowNs() + kRetryNs);
  }
  index_ = *index;
  auto link = Link::create(backplane, endpoint.window(), index_, server);
  auto& created = *link;
  incarnation_ = server->header().incarnation;
  {
    const std::lock_guard lock(*lock_);
    requests_ = std::make_unique<RequestTable>(created.header().maxOutstanding);
    channel_ = std::make_shared<MessageLink>(std::move(link), lock_);
    nudging_ = true;
  }
  if (wish_) segments::remove(wish_.name());
  wish_ = {};
  dispatcher_.setLink(index_, this);
  endpoint.attach(index_, created);
  setReason(fmt::format("server \"{}\" has not accepted the client yet", server_));
  server->knock(created.header().incarnation);
  knockedNs_ = Clock::nowNs();
  nudgeEveryNs_ = kFirstNudgeNs;
  wakeAt(knockedNs_ + nudgeEveryNs_);
} catch (const std::exception& error) {
  // No memory, no right, a window of another version: the reason is told, and it is tried again.
  setReason(error.what());
  wakeAt(Clock::nowNs() + kRetryNs);
}

// Shows whom we wait for, and has us told when a server appears.
void Binding::wish() {
  setReason(fmt::format("server \"{}\" at location {} is not there", server_, location_));
  dispatcher_.waitForNames(true);
  if (wish_) return;
  auto& endpoint = dispatcher_.endpoint();
  wish_ = Segment::create(sizeof(layout::SegmentHeader), layout::SegmentKind::wish, endpoint.backplane().name(), {0644, ~std::uint32_t{0}});
  auto& header = wish_.sharedHeader();
  header.ownerWindow = endpoint.window().header().incarnation;
  header.location = location_;
  server_.copy(header.name.data(), header.name.size() - 1);
  static_cast<void>(wish_.tryPublish(SegmentName::keyed(endpoint.backplane().name(), NameKind::wish, header.incarnation)));
  wish_.closeFile();
}

bool Binding::takeOne() {
  if (!channel_) return false;
  Envelope envelope;
  switch (channel_->tryBegin(envelope)) {
    case MessageLink::Take::message:
      deliverReply(envelope);
      return true;
    case MessageLink::Take::nonsense:
      count(dispatcher_.endpoint().control().protocolErrors);
      disconnect("the server sent nonsense", Ending::nonsense);
      return true;
    case MessageLink::Take::nothing:
      break;
  }
  return onLinkState();
}

// True when the state of the link was news.
bool Binding::onLinkState() {
  auto& link = channel_->link();
  const auto state = link.peerState();
  if (state == layout::LinkState::open && !isConnected()) {
    link.setPeerIndex(link.control().serverIndex.load(std::memory_order_relaxed) % layout::kMaxLinks);
    {
      const std::lock_guard lock(*lock_);
      fullTold_ = false;
      connected_.store(true, std::memory_order_relaxed);
    }
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

void Binding::deliverReply(const Envelope& envelope) {
  auto& control = dispatcher_.endpoint().control();
  count(control.received);
  auto* request = (envelope.flags & layout::kSlotFirstReply) != 0 ? requests_->find(envelope.requestId) : nullptr;
  if ((envelope.flags & layout::kSlotFirstReply) != 0 && (request == nullptr || request->isGivenUp)) {
    channel_->discard(envelope);
    if (request != nullptr) requests_->end(*request);
    return;
  }
  Message message;
  if (!channel_->tryFinish(envelope, message)) {
    count(control.protocolErrors);
    return disconnect("the server sent nonsense", Ending::nonsense);
  }
  if (envelope.sentTick != 0 || (request != nullptr && request->sentNs != 0)) noteTimes(envelope, request);
  message.setRoute({0, envelope.requestId, 0, nullptr});
  if (request != nullptr) {
    // A fate that the server sent without knowing them.
    if (message.getType() == MessageType::requestFate) {
      message.setClientType(request->clientType);
      message.setClientExtra(request->clientExtra);
    }
    requests_->end(*request);
    channel_->link().control().clientUnanswered.store(requests_->awaited(), std::memory_order_relaxed);
  }
  deliver(std::move(message));
}

void Binding::noteTimes(const Envelope& envelope, const Request* request) noexcept {
  auto& endpoint = dispatcher_.endpoint();
  const auto nowNs = Clock::nowNs();
  if (request != nullptr && request->sentNs != 0) record(endpoint.control().serviceNs, nowNs - request->sentNs);
  if (envelope.sentTick == 0) return;
  const auto waitedNs = Tick::nsSince(envelope.sentTick, nowNs);
  record(endpoint.control().queueWaitNs, waitedNs);
  if (endpoint.slept()) endpoint.noteWake(waitedNs);
}

void Binding::deliver(Message&& message) {
  if (!left_) callback_(std::move(message));
}

void Binding::deliverConnect(ConnectStatus status) { deliver(ConnectMessage({.status = status, .incarnation = incarnation_})); }

// A request that the server may still reply to keeps its entry until it has.
void Binding::deliverFate(Request& request, Fate fate) {
  if (request.isGivenUp) return;
  RequestFateMessage message({.fate = fate, .requestId = request.id.load(std::memory_order_relaxed)});
  message.setClientType(request.clientType);
  message.setClientExtra(request.clientExtra);
  message.setRoute({0, message->requestId, 0, nullptr});
  if (fate == Fate::cancelled || fate == Fate::expired) {
    requests_->giveUp(request);
  } else {
    requests_->end(request);
  }
  deliver(std::move(message));
}

bool Binding::hasDeadPeer() const noexcept { return channel_ && channel_->link().peer()->isDead(); }

void Binding::disconnect(const std::string& reason, Ending ending) {
  const auto self = shared_from_this();
  const auto channel = channel_;
  bool wasConnected = false;
  {
    const std::lock_guard lock(*lock_);
    wasConnected = connected_.exchange(false, std::memory_order_relaxed);
  }
  setReason(reason);
  auto& link = channel->link();
  Envelope envelope;
  while (channel_ == channel && channel->tryBegin(envelope) == MessageLink::Take::message) deliverReply(envelope);
  requests_->forEach([&](Request& request) {
    deliverFate(request, ending != Ending::nonsense && !link.isTaken(request.ordinal) ? Fate::neverTaken : Fate::outcomeUnknown);
  });
  if (channel_ != channel) return;  // a callback destroyed the client
  auto& endpoint = dispatcher_.endpoint();
  const bool serverDied = link.peer()->isDead();
  if (serverDied) count(endpoint.control().peersDied);
  link.setState(layout::LinkState::closed);
  if (!serverDied) link.notifyPeer();
  removeBulk(endpoint.backplane().name(), link.header().incarnation);
  segments::remove(link.name());
  endpoint.detach(index_);
  dispatcher_.setLink(index_, nullptr);
  count(endpoint.control().linksClosed);
  {
    const std::lock_guard lock(*lock_);
    channel_.reset();
  }
  if (wasConnected) deliverConnect(ConnectStatus::connectNo);
  if (left_) return;
  if (ending == Ending::serverGone) return tryConnect();
  wakeAt(Clock::nowNs() + kRetryNs);
}

void Binding::cancel(std::uint32_t requestId) {
  if (!requests_) return;
  if (auto* request = requests_->find(requestId)) deliverFate(*request, Fate::cancelled);
}

void Binding::leave() {
  left_ = true;
  if (channel_) disconnect("the client ended", Ending::serverGone);
  if (wish_) segments::remove(wish_.name());
  wish_ = {};
}

void Binding::onTime(std::int64_t nowNs) {
  dueNs_.store(INT64_MAX, std::memory_order_relaxed);
  if (!channel_) {
    if (isBound() && !left_) tryConnect();
    return;
  }
  // PAIR(due): a sender that lowers it from now on wakes us again.
  doorbell::fence();
  const auto self = shared_from_this();
  expire(nowNs);
  if (channel_) nudge(nowNs);
}

void Binding::expire(std::int64_t nowNs) {
  requests_->forEach([&](Request& request) {
    if (request.deadlineNs == 0 || request.isGivenUp) return;
    if (request.deadlineNs > nowNs) return wakeAt(request.deadlineNs);
    // PAIR(taken-before-clock): if the server has not counted it as taken, it will see that the deadline has passed.
    doorbell::fence();
    bool taken = false;
    {
      const std::lock_guard lock(*lock_);
      taken = channel_->link().isTaken(request.ordinal);
    }
    if (!taken) deliverFate(request, Fate::expired);
  });
}

// Hints may be lost to somebody who scribbles over them: while something is owed to us, ring again now and then.
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
    if (connected) {
      link.notifyPeer();
    } else {
      link.peer()->knock(link.header().incarnation);
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
