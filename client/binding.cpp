// SPDX-License-Identifier: MIT
#include "client/binding.h"

#include <cerrno>
#include <fmt/format.h>
#include <system_error>

#include "base/step.h"
#include "shm/histogram.h"
#include "shm/process.h"
#include "shm/segment_name.h"
#include "shm/shortage.h"

namespace mpf {
namespace {

Message fateMessage(Fate fate, std::uint32_t requestId, std::int32_t clientType,
                    std::int32_t clientExtra) {
  RequestFateMessage message({.fate = fate, .requestId = requestId});
  message.setClientType(clientType);
  message.setClientExtra(clientExtra);
  message.setRoute({0, requestId, kEndsRequest, nullptr});
  return message;
}

// What to do about an error, to be appended to its text: about a server that does not admit this
// user.
std::string_view remedyFor(const std::exception& error) noexcept {
  const auto* const failed = dynamic_cast<const std::system_error*>(&error);
  if (failed == nullptr || failed->code().value() != EACCES) return {};
  return "; start the server with --mode 0660 --group GROUP, or this program as its user";
}

}  // namespace

void Binding::setState(BindingState state) noexcept {
  const BiasedLock::Guard lock(*sender_.lock());
  state_.store(state, std::memory_order_relaxed);
}

void Binding::setServer(const std::string& server, std::int32_t location) {
  connector_.setServer(server, location);
  auto expected = BindingState::unbound;  // a client that has left stays in that state
  // PAIR(bound): the server's name, which the dispatcher's thread reads.
  state_.compare_exchange_strong(expected, BindingState::waiting, std::memory_order_release,
                                 std::memory_order_relaxed);
}

void Binding::setValueHandler(ValueHandler handler) {
  if (state() != BindingState::unbound)
    throw std::logic_error("MessageClient::onValues(): the client is bound already");
  if (values_.type != MessageType::none)
    throw std::logic_error("MessageClient::onValues(): the client has a callback for values");
  values_ = std::move(handler);
}

std::int32_t Binding::serverPid() const noexcept {
  const auto pidNamespace = Process::self().pidNamespace;  // may read a file
  const BiasedLock::Guard lock(*sender_.lock());
  if (!isConnected()) return 0;
  const auto& header = channel().link().peer()->header();
  return header.pidNamespace == pidNamespace ? header.ownerPid : 0;
}

void Binding::tryConnect() try {
  // Another thread in bind(), or a callback that ran the dispatcher, may have connected already.
  if (!isWaiting()) return;
  lacksResources_ = false;
  const auto server = connector_.tryFindServer();
  if (!server || !connector_.tryOpenLink(server, sender_)) return;
  sentSeen_ = 0;
  setState(BindingState::connecting);
  connector_.askForAcceptance(channel().link(), *this);
  nudgeInterval_.start(Clock::nowNs());
  timer_.wakeAt(nudgeInterval_.dueNs());
} catch (const std::exception& error) {
  // No memory, no permission, a window of another version: report the reason and try again later.
  lacksResources_ = shortageOf(error) != layout::Shortage::none;
  connector_.setReason(error.what(), remedyFor(error));
  connector_.retryLater();
}

// Acts on a change of the state of the link. Returns false when there was none.
bool Binding::onLinkState() {
  auto& link = channel().link();
  const auto peerState = link.peerState();
  if (link.isLost() || link.peer()->isLost()) {
    count(control().protocolErrors);
    disconnect("the shared memory of the connection was truncated", Ending::protocolError);
    return true;
  }
  if (peerState == layout::LinkState::open && !isConnected()) {
    onAccepted(link);
    return true;
  }
  if (peerState == layout::LinkState::closed && !link.incoming().hasMessage()) {
    disconnect("the server closed the connection", Ending::serverGone);
    return true;
  }
  if (peerState == layout::LinkState::refused) {
    disconnect("the server has its maximum number of clients", Ending::refused);
    deliverConnect(ConnectStatus::connectRefused);
    return true;
  }
  return false;
}

void Binding::onAccepted(Link& link) {
  link.usePeerIndexOfServer();
  setState(BindingState::connected);
  MPF_STEP(connected);
  connector_.notifyConnected();
  count(control().linksOpened);
  if (!sender_.untaken().isEmpty()) timer_.wakeAt(Clock::nowNs());  // onTime() sends them
  deliverConnect(ConnectStatus::connectYes);
}

void Binding::deliverConnect(ConnectStatus status) {
  deliver(ConnectMessage({.status = status, .incarnation = connector_.incarnation()}));
}

// A cancelled or expired request keeps its entry until the server replies to it or refuses it.
void Binding::deliverFate(Request& request, Fate fate) {
  if (request.isGivenUp) return;
  auto message = fateMessage(fate, request.id.load(std::memory_order_relaxed), request.clientType,
                             request.clientExtra);
  if (fate == Fate::cancelled || fate == Fate::expired) {
    sender_.requests()->giveUp(request);
  } else {
    sender_.requests()->end(request);
  }
  MPF_STEP(fate_given);
  if (sender_.channel()) showAnswered();
  deliver(std::move(message));
}

void Binding::deliverFate(const UntakenRequest& request, Fate fate) {
  deliver(fateMessage(fate, request.id, request.message->getClientType(),
                      request.message->getClientExtra()));
}

bool Binding::hasDeadPeer() const noexcept {
  return isLinked() && channel().link().peer()->isDead();
}

void Binding::disconnect(std::string_view reason, Ending ending) {
  connector_.setReason(reason);
  resume();
  const bool deliversRest = ending == Ending::serverGone && !hasLeft();
  end_ = {ending, isConnected(), deliversRest ? channel().link().geometry().allReplySlots() : 0};
  if (!hasLeft()) setState(BindingState::ending);
  MPF_STEP(disconnecting);
  resumeEnd();
}

// When a callback throws, its message counts as delivered, and onTime() continues the rest.
void Binding::resumeEnd() {
  const auto self = shared_from_this();
  try {
    endAll();
  } catch (...) {
    if (state() == BindingState::ending) {
      setState(BindingState::interrupted);
      timer_.wakeAt(Clock::nowNs());
    }
    throw;
  }
}

void Binding::endAll() {
  auto channel = sender_.channel();
  const auto requests = sender_.requests();
  const auto ending = end_.ending;
  deliverRemaining(channel.get());
  requests->forEach([&](Request& request) {
    const bool isUntaken =
        ending != Ending::protocolError && !channel->link().outgoing().isTaken(request.ordinal());
    if (isUntaken && !hasLeft() && sender_.tryKeep(request)) return;
    deliverFate(request, isUntaken ? Fate::neverTaken : Fate::outcomeUnknown);
  });
  if (sender_.channel() != channel) return;  // a callback destroyed the client
  const bool wasConnected = end_.wasConnected;
  resume();  // a callback may have called pause() again
  channel.reset();  // else the window of the server could not be unmapped
  connector_.closeLink(sender_);
  if (!hasLeft()) setState(BindingState::waiting);
  try {
    if (wasConnected) deliverConnect(ConnectStatus::connectNo);
  } catch (...) {
    lookForServer(ending);
    throw;
  }
  lookForServer(ending);
}

void Binding::lookForServer(Ending ending) {
  if (hasLeft()) return;
  if (ending == Ending::serverGone) return tryConnect();
  connector_.retryLater();
}

void Binding::cancel(std::uint32_t requestId) {
  if (!sender_.requests()) return;
  if (auto* request = sender_.requests()->find(requestId); request != nullptr && isSent(*request))
    return deliverFate(*request, Fate::cancelled);
  const auto isIt = [requestId](const UntakenRequest& request) { return request.id == requestId; };
  if (const auto request = sender_.takeUntaken(isIt)) deliverFate(*request, Fate::cancelled);
}

void Binding::pause() {
  if (!sender_.channel() || std::exchange(isPaused_, true)) return;
  parts_.endpoint.hold(connector_.index());
}

void Binding::resume() {
  if (std::exchange(isPaused_, false))
    parts_.endpoint.release(connector_.index(), channel().link());
}

void Binding::leave() {
  setState(BindingState::left);
  if (sender_.channel()) disconnect("the client was destroyed", Ending::serverGone);
  connector_.cancelPendingBind();
}

void Binding::onTime(std::int64_t nowNs) {
  timer_.reset();
  if (state() == BindingState::interrupted) {
    setState(BindingState::ending);
    return resumeEnd();
  }
  const auto self = shared_from_this();
  try {
    expireUntaken(nowNs);
    if (!isLinked()) return tryConnect();
    expire(nowNs);
    if (isConnected()) sendUntaken();
    if (isLinked()) nudge(nowNs);
  } catch (...) {
    timer_.wakeAt(nowNs);  // the next call handles the other requests
    throw;
  }
}

void Binding::expire(std::int64_t nowNs) {
  const auto requests = sender_.requests();
  const auto channel = sender_.channel();
  // PAIR(taken-before-clock): if the server has not counted a request as taken, it will see that
  // the deadline has passed.
  doorbell::fence();
  std::uint32_t at = 0;
  std::int64_t nextNs = INT64_MAX;
  while (const auto id = sender_.findExpired(at, nowNs, nextNs)) {
    deliverFate(*requests->find(id), Fate::expired);
    if (sender_.channel() != channel || !isLinked()) return;  // a callback ran the dispatcher
  }
  if (nextNs != INT64_MAX) timer_.wakeAt(nextNs);
}

void Binding::expireUntaken(std::int64_t nowNs) {
  const auto hasExpired = [nowNs](const auto& request) { return request.hasExpired(nowNs); };
  while (const auto request = sender_.takeUntaken(hasExpired)) deliverFate(*request, Fate::expired);
  for (const auto& request : sender_.untaken().all()) {
    if (request.deadlineNs != 0) timer_.wakeAt(request.deadlineNs);
  }
}

// Sends the requests that no server has taken, as far as the present server has room for them. Ends
// those for which it never will have room.
void Binding::sendUntaken() {
  while (!sender_.untaken().isEmpty()) {
    const auto result = sender_.trySendUntaken();
    if (result == SendResult::sent) continue;
    const auto bytes = sender_.untaken().all().front().message->body().size();
    // Not connected: a callback has run the dispatcher.
    if (result == SendResult::notConnected || channel().link().maySend(bytes))
      return timer_.wakeAt(Clock::nowNs() + kSendUntakenAfterNs);
    const auto isFirst = [](const UntakenRequest&) { return true; };
    deliverFate(*sender_.takeUntaken(isFirst), Fate::neverTaken);
  }
}

// A faulty process may overwrite hints in shared memory. While a reply is outstanding, this rings
// the server's doorbell again from time to time.
void Binding::nudge(std::int64_t nowNs) {
  if (isConnected() && sender_.tryEndNudging()) return nudgeInterval_.reset();
  if (nudgeInterval_.tryTake(nowNs)) {
    auto& link = channel().link();
    link.peer()->forceNextRing();
    if (isConnected()) {
      link.notifyPeer();
    } else if (link.peer()->isClosed()) {
      return disconnect("the server exited before it accepted the client", Ending::serverGone);
    } else {
      connector_.askAgain(link);
    }
    takeSome(1);  // a reply or a change of the link whose hint was lost
  }
  timer_.wakeAt(nudgeInterval_.dueNs());
}

// Called by any thread, under the lock of the sender.
void Binding::postFullReport() {
  parts_.commands.postLater([weak = weak_from_this()] {
    const auto self = weak.lock();
    if (self && self->isConnected()) self->deliverConnect(ConnectStatus::connectQueueFull);
  });
}

}  // namespace mpf
