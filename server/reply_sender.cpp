// SPDX-License-Identifier: MIT
#include "server/reply_sender.h"

#include <algorithm>
#include <memory>

#include <mpf/clock.h>

#include "base/step.h"

namespace mpf {

ReplyResult ReplySender::send(Message& message) noexcept {
  if (!message || message.route().link == 0 || forkGuard_.isInherited())
    return ReplyResult::clientGone;
  auto& connection = Connection::of(message.route());
  ReplyResult result{};
  {
    const BiasedLock::Guard lock(*connection.lock);
    result = sendOneLocked(connection, message);
  }
  if (result == ReplyResult::sent || result == ReplyResult::clientGone) message.reset();
  return result;
}

RepliedMany ReplySender::sendMany(std::span<Message> messages) noexcept {
  RepliedMany sent;
  while (sent.count < messages.size() && sent.result == ReplyResult::sent) {
    const auto rest = messages.subspan(sent.count);
    auto run = sendRun(rest);
    if (run.result == ReplyResult::clientGone) run = {1, ReplyResult::sent};
    for (auto& message : rest.first(run.count)) message.reset();
    sent = {sent.count + run.count, run.result};
  }
  return sent;
}

// Sends those of the first messages that go to the same client; the caller empties the messages
// that are counted, without the lock. The result is `clientGone` only if none was sent.
RepliedMany ReplySender::sendRun(std::span<Message> messages) noexcept {
  const auto& route = messages.front().route();
  if (route.link == 0 || forkGuard_.isInherited()) return {0, ReplyResult::clientGone};
  auto& connection = Connection::of(route);
  const BiasedLock::Guard lock(*connection.lock);
  if (!connection.isOpenFor(route)) return {0, ReplyResult::clientGone};
  auto& link = connection.channel->link();
  const Link::Batch batch(link);
  const auto sentBefore = link.outgoing().messages();
  RepliedMany sent;
  const auto client = route.link;
  const auto generation = route.flags;
  for (auto& message : messages) {
    if (message.route().link != client || message.route().flags != generation) break;
    if (message) sent.result = sendLocked(connection, message);
    if (sent.result != ReplyResult::sent) break;
    ++sent.count;
  }
  if (const auto number = link.outgoing().messages() - sentBefore; number != 0)
    counts_.sent(number);
  return sent;
}

RepliedMany ReplySender::sendBodies(const Message& request, ReplyBodies bodies) noexcept {
  constexpr std::size_t kMaxRun = 1024;  // other threads may wait for the lock
  RepliedMany sent;
  while (!bodies.all.empty() && sent.result == ReplyResult::sent) {
    const auto bytes = std::min(bodies.all.size(), kMaxRun * bodies.size);
    const auto run = sendRun(request, {bodies.type, bodies.size, bodies.all.first(bytes)});
    sent = {sent.count + run.count, run.result};
    bodies.all = bodies.all.subspan(bytes);
  }
  return sent;
}

RepliedMany ReplySender::sendRun(const Message& request, ReplyBodies bodies) noexcept {
  const auto& route = request.route();
  if (route.link == 0 || forkGuard_.isInherited()) return {0, ReplyResult::clientGone};
  auto& connection = Connection::of(route);
  const BiasedLock::Guard lock(*connection.lock);
  if (!connection.isOpenFor(route)) return {0, ReplyResult::clientGone};
  const Link::Batch batch(connection.channel->link());
  RepliedMany sent;
  const bool fillsSlot = bodies.size == layout::kFirstSlotBodyBytes &&
                         bodies.size <= connection.channel->link().maxMessageBytes();
  // The first reply, which ends the request, and bodies of other lengths go as messages. They are
  // copies: a body in a chunk would be sent in place, and the chunk belongs to the caller.
  while (!bodies.all.empty() && (!fillsSlot || connection.owes(route.requestId))) {
    auto message = Message::copyInline(bodies.type, bodies.all.first(bodies.size));
    message.setRoute({route.link, route.requestId, route.flags, nullptr});
    message.setClientType(request.getClientType());
    message.setClientExtra(request.getClientExtra());
    sent.result = sendLocked(connection, message);
    if (sent.result != ReplyResult::sent) break;
    ++sent.count;
    bodies.all = bodies.all.subspan(bodies.size);
  }
  if (sent.result == ReplyResult::sent) sendFullSlotsLocked(connection, request, bodies, sent);
  if (sent.count != 0) counts_.sent(sent.count);
  return sent;
}

// Sends further replies to `request`, whose bodies fill a slot.
void ReplySender::sendFullSlotsLocked(Connection& connection, const Message& request,
                                      ReplyBodies bodies, RepliedMany& sent) noexcept {
  auto& link = connection.channel->link();
  Envelope envelope{
      .type = static_cast<std::uint16_t>(bodies.type),
      .requestId = request.route().requestId,
      .clientType = request.getClientType(),
      .clientExtra = request.getClientExtra(),
      .timeNs = stamps_ ? Clock::wallNs() : 0,
  };
  const auto noteSent = [&serverSent = link.control().serverSent](std::uint64_t messages) {
    MPF_STEP(reply_sent);
    serverSent.store(messages, std::memory_order_relaxed);
  };
  while (!bodies.all.empty()) {
    const auto count = link.trySendRun(envelope, bodies.all, link.slotsOfFirstReplies(), noteSent);
    if (count == 0) {
      sent.result = noteRefused(LinkSend::full);
      return;
    }
    sent.count += count;
    bodies.all = bodies.all.subspan(count * bodies.size);
  }
}

[[gnu::always_inline]] inline ReplyResult ReplySender::sendOneLocked(Connection& connection,
                                                                     Message& message) noexcept {
  if (!connection.isOpenFor(message.route())) return ReplyResult::clientGone;
  const auto result = sendLocked(connection, message);
  if (result == ReplyResult::sent) counts_.sent();
  return result;
}

// Inline, because it is on the path of each message.
[[gnu::always_inline]] inline ReplyResult ReplySender::sendLocked(Connection& connection,
                                                                  Message& message) noexcept {
  auto& link = connection.channel->link();
  // First: values that were computed before a call would have to be saved on the stack.
  const auto sentNs = link.timeOfNext();
  const auto givenNs = message.getTimeStampNs();
  const auto timeNs = stamps_ && givenNs == 0 ? Clock::wallNs() : givenNs;
  const auto requestId = message.route().requestId;
  const bool isFirst = connection.owes(requestId);
  const auto envelope = [&]() __attribute__((always_inline)) {
    return Envelope{
        .type = static_cast<std::uint16_t>(message.getType()),
        .flags = isFirst ? layout::kSlotFirstReply : std::uint8_t{0},
        .requestId = requestId,
        .clientType = detail::alone(message.getClientType()),
        .clientExtra = detail::alone(message.getClientExtra()),
        .sentTick = Tick::ofSample(sentNs),
        .timeNs = timeNs,
    };
  };
  const auto reserve = isFirst ? 0 : link.slotsOfFirstReplies();
  const auto result = connection.channel->trySendLocked(envelope, message, {0, reserve});
  if (result != LinkSend::sent && result != LinkSend::sentInPlace) return noteRefused(result);
  MPF_STEP(reply_sent);
  link.control().serverSent.store(link.outgoing().messages(), std::memory_order_relaxed);
  if (!isFirst) return ReplyResult::sent;
  static_cast<void>(message.exchangeKeeper(nullptr));
  connection.owed(requestId).store(0, std::memory_order_relaxed);
  if (requestId == connection.timedId) noteServiceTime(connection);
  return ReplyResult::sent;
}

// After the first reply to the request that is timed.
void ReplySender::noteServiceTime(Connection& connection) noexcept {
  counts_.service(Clock::nowNs() - connection.timedFromNs);
  connection.timedId = 0;
}

ReplyResult ReplySender::noteRefused(LinkSend result) noexcept {
  counts_.notSent();
  if (result == LinkSend::full) return ReplyResult::queueFull;
  return result == LinkSend::tooLarge ? ReplyResult::tooLarge : ReplyResult::noMemory;
}

void ReplySender::sendFate(Connection& connection, RequestMarks request, Fate fate) noexcept {
  RequestFateMessage message({.fate = fate, .requestId = request.requestId});
  message.setClientType(request.clientType());
  message.setClientExtra(request.clientExtra());
  message.setRoute(connection.routeOf(request.requestId, nullptr));
  static_cast<void>(send(message));
}

void ReplySender::refuseAbandoned(const Route& route) noexcept {
  auto& connection = Connection::of(route);
  const BiasedLock::Guard lock(*connection.lock);
  if (!connection.isOpenFor(route) || !connection.owes(route.requestId)) return;
  Message message = RequestFateMessage({.fate = Fate::refused, .requestId = route.requestId});
  message.setRoute(connection.routeOf(route.requestId, nullptr));
  if (sendOneLocked(connection, message) == ReplyResult::sent) counts_.refused();
}

BodyBytes ReplySender::tryAllocateInPool(const Route& route, std::size_t bytes) noexcept {
  auto& connection = Connection::of(route);
  const BiasedLock::Guard lock(*connection.lock);
  return connection.isOpenFor(route) ? connection.channel->tryAllocateLocked(bytes) : BodyBytes{};
}

BodyBytes ReplySender::allocate(const Route& route, std::size_t bytes) {
  auto body = route.link != 0 ? tryAllocateInPool(route, bytes) : BodyBytes{};
  if (body.data == nullptr) body = allocateHeapBody(bytes);
  return body;
}

}  // namespace mpf
