// SPDX-License-Identifier: MIT
#include "server/reply_sender.h"

#include <algorithm>
#include <memory>

#include <mpf/clock.h>

#include "base/step.h"
#include "server/reply_result.h"

namespace mpf {
namespace {

// Shows the number of messages sent to the tools.
void showSent(Link& link) noexcept {
  MPF_STEP(reply_sent);
  link.control().serverSent.store(link.outgoing().messages(), std::memory_order_relaxed);
}

}  // namespace

ReplyResult ReplySender::send(Message& message) noexcept {
  auto result = ReplyResult::clientGone;
  if (auto* const connection = Connection::tryOf(message.route()); connection && message) {
    const BiasedLock::Guard lock(*connection->lock);
    result = sendOneLocked(*connection, message);
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
  auto* const connection = Connection::tryOf(route);
  if (connection == nullptr) return {0, ReplyResult::clientGone};
  const BiasedLock::Guard lock(*connection->lock);
  if (!connection->isOpenFor(route)) return {0, ReplyResult::clientGone};
  auto& link = connection->channel->link();
  const Link::Batch batch(link);
  const auto sentBefore = link.outgoing().messages();
  RepliedMany sent;
  const auto client = route.link;
  const auto generation = route.flags;
  for (auto& message : messages) {
    if (message.route().link != client || message.route().flags != generation) break;
    if (message) sent.result = sendLocked(*connection, message);
    if (sent.result != ReplyResult::sent) break;
    ++sent.count;
  }
  if (const auto number = link.outgoing().messages() - sentBefore; number != 0)
    counts_.sent(number);
  return sent;
}

RepliedMany ReplySender::sendBodies(const Message& request, const Bodies& bodies) noexcept {
  constexpr std::size_t kMaxRun = 1024;  // other threads may wait for the lock
  const auto count = bodies.count();
  RepliedMany sent;
  while (sent.count < count && sent.result == ReplyResult::sent) {
    const auto rest = bodies.from(sent.count);
    const auto run = sendRun(request, rest.first(std::min(rest.count(), kMaxRun)));
    sent = {sent.count + run.count, run.result};
  }
  return sent;
}

RepliedMany ReplySender::sendRun(const Message& request, const Bodies& bodies) noexcept {
  const auto& route = request.route();
  auto* const connection = Connection::tryOf(route);
  if (connection == nullptr) return {0, ReplyResult::clientGone};
  const BiasedLock::Guard lock(*connection->lock);
  if (!connection->isOpenFor(route)) return {0, ReplyResult::clientGone};
  const Link::Batch batch(connection->channel->link());
  const auto count = bodies.count();
  RepliedMany sent;
  const bool fillSlots =
      bodies.fillSlots() && bodies.size <= connection->channel->link().maxMessageBytes();
  // The first reply, which ends the request, and bodies of other lengths go as messages. They are
  // copies: a body in a chunk would be sent in place, and the chunk belongs to the caller.
  while (sent.count < count && (!fillSlots || connection->isUnanswered(route))) {
    auto message = Message::copyInline(bodies.type, bodies.from(sent.count).first(1).all);
    message.setRoute({route.link, route.requestId, route.flags, nullptr});
    message.setClientType(request.getClientType());
    message.setClientExtra(request.getClientExtra());
    sent.result = sendLocked(*connection, message);
    if (sent.result != ReplyResult::sent) break;
    ++sent.count;
  }
  if (sent.result == ReplyResult::sent) sendFullSlotsLocked(*connection, request, bodies, sent);
  if (sent.count != 0) counts_.sent(sent.count);
  return sent;
}

// Sends those bodies that were not sent yet as further replies to `request`.
void ReplySender::sendFullSlotsLocked(Connection& connection, const Message& request,
                                      const Bodies& bodies, RepliedMany& sent) noexcept {
  auto& link = connection.channel->link();
  const auto untimed = EnvelopeWords::of({.type = static_cast<std::uint16_t>(bodies.type),
                                          .requestId = request.route().requestId,
                                          .clientType = request.getClientType(),
                                          .clientExtra = request.getClientExtra(),
                                          .timeNs = stamps_ ? Clock::wallNs() : 0},
                                         1, layout::kFirstSlotBodyBytes);
  const auto words = [&](std::size_t, std::int64_t sentNs) {
    auto timed = untimed;
    if (sentNs != 0) timed.client = untimed.clientWith(Tick::ofSample(sentNs));
    return timed;
  };
  for (const auto count = bodies.count(); sent.count < count;) {
    // A run may end with the move to the second ring, where more slots are reserved.
    const Link::Limits limits{0, link.slotsOfFirstReplies()};
    const auto run = link.trySendRun(words, bodies.from(sent.count).all, limits);
    if (run == 0) {
      sent.result = noteRefused(LinkSend::full);
      return;
    }
    showSent(link);
    sent.count += run;
  }
}

void ReplySender::sendRun(Connection& connection, std::uint32_t generation,
                          const MessageRun& run) noexcept {
  // The handler may have received further requests, and closed the connection.
  const Route route{reinterpret_cast<std::uint64_t>(&connection), 0, generation, nullptr};
  const auto sent = sendRun(route, run, true);
  if (sent < run.size()) refuse(connection, generation, run, sent);
}

std::size_t ReplySender::sendRun(const Route& route, const MessageRun& run, bool isFirst) noexcept {
  auto* const connection = Connection::tryOf(route);
  if (connection == nullptr) return 0;
  const BiasedLock::Guard lock(*connection->lock);
  if (!connection->isOpenFor(route) ||
      connection->channel->link().maxMessageBytes() < layout::kFirstSlotBodyBytes)
    return 0;
  std::size_t count = 0;
  while (count < run.size() && connection->isUnanswered(run[count].requestId()) == isFirst) ++count;
  return sendRunLocked(*connection, run, count, isFirst);
}

// Sends the first `count` messages of a run. Returns the number of replies. There is room for all
// first replies, unless the client has sent more requests than it may.
std::size_t ReplySender::sendRunLocked(Connection& connection, const MessageRun& run,
                                       std::size_t count, bool isFirst) noexcept {
  auto& link = connection.channel->link();
  const auto stamp = stamps_ ? static_cast<std::uint64_t>(Clock::wallNs()) : 0;
  const auto body = EnvelopeWords::fullSlot(static_cast<std::uint16_t>(run.type()),
                                            isFirst ? layout::kSlotFirstReply : std::uint8_t{0});
  std::size_t sent = 0;
  const auto words = [&](std::size_t index, std::int64_t sentNs) {
    const auto& given = run[sent + index];
    return EnvelopeWords{body, given.request, given.clientWith(Tick::ofSample(sentNs)),
                         given.timeNs != 0 ? given.timeNs : stamp};
  };
  const Link::Batch batch(link);
  while (sent < count) {
    const Link::Limits limits{0, isFirst ? 0 : link.slotsOfFirstReplies()};
    const auto next = link.trySendRun(words, run.values(sent, count - sent), limits);
    if (next == 0) break;
    showSent(link);
    sent += next;
  }
  for (std::size_t index = 0; isFirst && index < sent; ++index) {
    connection.noteFirstReply(run[index].requestId(), counts_);
  }
  counts_.sent(sent);
  return sent;
}

void ReplySender::refuse(Connection& connection, std::uint32_t generation, const MessageRun& run,
                         std::size_t index) noexcept {
  for (; index < run.size(); ++index)
    refuseAbandoned({reinterpret_cast<std::uint64_t>(&connection), run[index].requestId(),
                     generation, nullptr});
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
  // Called first, so that no computed value must be saved on the stack during the call.
  const auto sentNs = link.timeOfNext();
  const auto givenNs = message.getTimeStampNs();
  const auto timeNs = stamps_ && givenNs == 0 ? Clock::wallNs() : givenNs;
  const auto requestId = message.route().requestId;
  const bool isFirst = connection.isUnanswered(message.route());
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
  const auto result = connection.channel->trySendLocked(link, envelope, message, {0, reserve});
  if (result != LinkSend::sent && result != LinkSend::sentInPlace) return noteRefused(result);
  showSent(link);
  if (!isFirst) return ReplyResult::sent;
  static_cast<void>(message.exchangeKeeper(nullptr));
  connection.noteFirstReply(requestId, counts_);
  return ReplyResult::sent;
}

ReplyResult ReplySender::noteRefused(LinkSend result) noexcept {
  counts_.notSent();
  return replyResult(result);
}

void ReplySender::sendFate(Connection& connection, RequestMarks request, Fate fate) noexcept {
  RequestFateMessage message({.fate = fate, .requestId = request.requestId});
  message.setClientType(request.clientType());
  message.setClientExtra(request.clientExtra());
  message.setRoute(connection.routeOf(request.requestId, nullptr));
  static_cast<void>(send(message));
}

void ReplySender::refuseAbandoned(const Route& route) noexcept {
  auto* const connection = Connection::tryOf(route);
  if (connection == nullptr) return;
  const BiasedLock::Guard lock(*connection->lock);
  if (!connection->isOpenFor(route) || !connection->isUnanswered(route)) return;
  Message message = RequestFateMessage({.fate = Fate::refused, .requestId = route.requestId});
  message.setRoute({route.link, route.requestId, route.flags, nullptr});
  if (sendOneLocked(*connection, message) == ReplyResult::sent) counts_.refused();
}

BodyBytes ReplySender::tryAllocateInPool(const Route& route, std::size_t bytes) noexcept {
  auto* const connection = Connection::tryOf(route);
  if (connection == nullptr) return {};
  const BiasedLock::Guard lock(*connection->lock);
  return connection->isOpenFor(route) ? connection->channel->tryAllocateLocked(bytes) : BodyBytes{};
}

BodyBytes ReplySender::allocate(const Route& route, std::size_t bytes) {
  auto body = tryAllocateInPool(route, bytes);
  if (body.data == nullptr) body = allocateHeapBody(bytes);
  return body;
}

}  // namespace mpf
