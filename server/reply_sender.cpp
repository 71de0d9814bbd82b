// SPDX-License-Identifier: MIT
#include "server/reply_sender.h"

#include <algorithm>
#include <memory>
#include <mutex>

#include <mpf/clock.h>

#include "base/step.h"
#include "shm/histogram.h"

namespace mpf {

ReplyResult ReplySender::send(Message& message) noexcept {
  if (!message || message.route().link == 0 || forkGuard_.isInherited())
    return ReplyResult::clientGone;
  auto& connection = Connection::of(message.route());
  ReplyResult result{};
  {
    const std::lock_guard lock(*connection.lock);
    result = sendLocked(connection, message);
  }
  if (result == ReplyResult::sent || result == ReplyResult::clientGone) message.reset();
  return result;
}

RepliedMany ReplySender::sendMany(std::span<Message> messages) noexcept {
  RepliedMany sent;
  while (sent.count < messages.size() && sent.result == ReplyResult::sent) {
    auto rest = messages.subspan(sent.count);
    const auto route = rest.front().route();
    const auto differs = [&](const Message& message) {
      return message.route().link != route.link || message.route().flags != route.flags;
    };
    const auto end = std::find_if(rest.begin(), rest.end(), differs);
    const auto run = sendRun(rest.first(static_cast<std::size_t>(end - rest.begin())));
    for (auto& message : rest.first(run.count)) message.reset();
    sent = {sent.count + run.count, run.result};
  }
  return sent;
}

// Replies to one client. The caller empties those that are counted, without the lock.
RepliedMany ReplySender::sendRun(std::span<Message> messages) noexcept {
  const auto& route = messages.front().route();
  if (route.link == 0 || forkGuard_.isInherited()) return {messages.size(), ReplyResult::sent};
  auto& connection = Connection::of(route);
  const std::lock_guard lock(*connection.lock);
  if (!connection.isOpenFor(route)) return {messages.size(), ReplyResult::sent};
  const Link::Batch batch(connection.channel->link());
  RepliedMany sent;
  for (; sent.count < messages.size(); ++sent.count) {
    auto& message = messages[sent.count];
    if (!message) continue;
    sent.result = sendLocked(connection, message);
    if (sent.result != ReplyResult::sent) break;
  }
  return sent;
}

ReplyResult ReplySender::sendLocked(Connection& connection, Message& message) noexcept {
  if (!connection.isOpenFor(message.route())) return ReplyResult::clientGone;
  const auto requestId = message.route().requestId;
  auto& owed = connection.owed(requestId);
  const bool first = connection.owes(requestId);
  auto& link = connection.channel->link();
  Envelope envelope;
  envelope.type = static_cast<std::uint16_t>(message.getType());
  envelope.flags = first ? layout::kSlotFirstReply : std::uint8_t{0};
  envelope.requestId = requestId;
  envelope.clientType = message.getClientType();
  envelope.clientExtra = message.getClientExtra();
  envelope.timeNs = message.getTimeStampNs();
  if (stamps_ && envelope.timeNs == 0) envelope.timeNs = Clock::wallNs();
  if (link.shouldSampleTime()) envelope.sentTick = Tick::of(Clock::nowNs());

  auto* const keeper = first ? message.exchangeKeeper(nullptr) : nullptr;
  const Link::Limits limits{0, first ? 0 : link.maxOutstanding()};
  const auto result = connection.channel->trySendLocked(envelope, message, limits);
  if (result == LinkSend::sent || result == LinkSend::sentInPlace) {
    MPF_STEP(reply_sent);
    if (first) owed.store(0, std::memory_order_relaxed);
    count(control_.sent);
    link.control().serverSent.store(link.outgoing().messages(), std::memory_order_relaxed);
    if (requestId == connection.timedId && first) {
      record(control_.serviceNs, Clock::nowNs() - connection.timedFromNs);
      connection.timedId = 0;
    }
    return ReplyResult::sent;
  }
  if (first) message.exchangeKeeper(keeper);
  count(control_.replyQueueFull);
  if (result == LinkSend::full) return ReplyResult::queueFull;
  return result == LinkSend::tooLarge ? ReplyResult::tooLarge : ReplyResult::noMemory;
}

void ReplySender::sendFate(Connection& connection, Envelope request, Fate fate) noexcept {
  RequestFateMessage message({.fate = fate, .requestId = request.requestId});
  message.setClientType(request.clientType);
  message.setClientExtra(request.clientExtra);
  message.setRoute(connection.routeOf(request.requestId, nullptr));
  static_cast<void>(send(message));
}

void ReplySender::refuseAbandoned(const Route& route) noexcept {
  auto& connection = Connection::of(route);
  const std::lock_guard lock(*connection.lock);
  if (!connection.isOpenFor(route) || !connection.owes(route.requestId)) return;
  RequestFateMessage message({.fate = Fate::refused, .requestId = route.requestId});
  message.setRoute(connection.routeOf(route.requestId, nullptr));
  if (sendLocked(connection, message) == ReplyResult::sent) count(control_.refused);
}

BodyBytes ReplySender::allocate(const Route& route, std::size_t bytes) {
  std::shared_ptr<MessageLink> channel;
  if (route.link != 0) {
    auto& connection = Connection::of(route);
    const std::lock_guard lock(*connection.lock);
    if (connection.isOpenFor(route)) channel = connection.channel;
  }
  return channel ? channel->allocate(bytes) : allocateHeapBody(bytes);
}

}  // namespace mpf
