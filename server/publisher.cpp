// SPDX-License-Identifier: MIT
#include "server/publisher.h"

#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <new>
#include <stdexcept>
#include <utility>

#include <mpf/clock.h>

#include "base/step.h"
#include "server/reply_result.h"

namespace mpf {
namespace {

constexpr int kMostBorrowed = 64;

std::uint32_t checkedMaxBorrowed(int count) {
  if (count < 1 || count > kMostBorrowed) {
    throw std::invalid_argument(fmt::format("max borrowed {}: use 1 to {}", count, kMostBorrowed));
  }
  return static_cast<std::uint32_t>(count);
}

auto chunkAt(const std::vector<std::shared_ptr<FanOutChunk>>& chunks, const std::byte* data) {
  return std::ranges::find_if(chunks, [data](const auto& chunk) { return chunk->data() == data; });
}

}  // namespace

// ---- bodies of the program

BodyBytes FanOutBodies::lend(std::shared_ptr<FanOutChunk> chunk, std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  const BodyBytes body{chunk->data(), bytes, chunk->capacity(), this};
  lent_.push_back(std::move(chunk));
  self_ = shared_from_this();
  return body;
}

std::shared_ptr<FanOutChunk> FanOutBodies::tryFind(const std::byte* data) const noexcept {
  if (forkGuard_.isInherited()) return nullptr;
  const std::lock_guard lock(mutex_);
  const auto lent = chunkAt(lent_, data);
  return lent == lent_.end() ? nullptr : *lent;
}

void FanOutBodies::takeBack(std::byte* data, std::size_t) noexcept {
  if (forkGuard_.isInherited()) return;
  std::shared_ptr<FanOutBodies> last;  // destroyed after the guard; may destroy this object
  const std::lock_guard lock(mutex_);
  const auto lent = chunkAt(lent_, data);
  (*lent)->drop();
  lent_.erase(lent);
  if (lent_.empty()) last = std::move(self_);
}

// ---- publisher

Publisher::Publisher(const std::string& backplane, OwnWindow& window, ReplyCounts& counts,
                     const ServerOptions& options)
    : counts_(counts),
      serverWindow_(window.header().incarnation),
      maxBorrowed_(checkedMaxBorrowed(options.maxBorrowed)),
      stamps_(options.stampsReplies),
      pool_(std::make_shared<FanOutPool>(backplane, serverWindow_, options.rights,
                                         options.maxSharedBytes)) {}

std::shared_ptr<FanOutChunk> Publisher::tryAlloc(std::size_t bytes) noexcept {
  if (forkGuard_.isInherited()) return nullptr;
  if (auto chunk = pool_->tryAlloc(bytes)) return chunk;
  collectReturned();
  return pool_->tryAlloc(bytes);
}

BodyBytes Publisher::allocate(std::size_t bytes) {
  auto chunk = tryAlloc(bytes);
  if (!chunk) return allocateHeapBody(bytes);
  try {
    return bodies_->lend(chunk, bytes);
  } catch (...) {
    chunk->drop();
    throw;
  }
}

std::shared_ptr<FanOutChunk> Publisher::tryCopy(std::span<const std::byte> body) noexcept {
  auto chunk = tryAlloc(body.size());
  if (chunk && !body.empty()) std::memcpy(chunk->data(), body.data(), body.size());
  return chunk;
}

std::size_t Publisher::publish(const Message& message, std::span<const Message> requests,
                               std::span<ReplyResult> results) noexcept {
  const bool isShared = message.lender() == bodies_.get();
  const auto chunk = isShared ? bodies_->tryFind(message.body().data()) : tryCopy(message.body());
  std::size_t sent = 0;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const auto result = send(message, requests[i], chunk, std::nullopt);
    if (result == ReplyResult::sent) ++sent;
    else if (result != ReplyResult::clientGone) counts_.notSent();
    if (i < results.size()) results[i] = result;
  }
  if (chunk && !isShared) chunk->drop();
  return sent;
}

ReplyResult Publisher::relay(const Message& message, std::uint32_t missed) noexcept {
  const auto chunk = tryCopy(message.body());
  const auto result = send(message, message, chunk, missed);
  if (chunk) chunk->drop();
  return result;
}

ReplyResult Publisher::send(const Message& message, const Message& request,
                            const std::shared_ptr<FanOutChunk>& chunk, Missed missed) noexcept {
  auto* const connection = Connection::tryOf(request.route());
  if (!message || !request || connection == nullptr) return ReplyResult::clientGone;
  const BiasedLock::Guard lock(*connection->lock);
  return sendLocked(*connection, message, request, chunk, missed);
}

ReplyResult Publisher::sendLocked(Connection& connection, const Message& message,
                                  const Message& request, const std::shared_ptr<FanOutChunk>& chunk,
                                  Missed missed) noexcept {
  const auto route = request.route();
  if (!connection.isOpenFor(route)) return ReplyResult::clientGone;
  auto& link = connection.channel->link();
  if (link.header().serverWindow != serverWindow_) return ReplyResult::clientGone;
  const bool first = connection.isUnanswered(route);
  Envelope envelope;
  envelope.type = static_cast<std::uint16_t>(message.getType());
  envelope.flags = first ? layout::kSlotFirstReply : std::uint8_t{0};
  envelope.requestId = route.requestId;
  envelope.clientType = request.getClientType();
  envelope.clientExtra = request.getClientExtra();
  envelope.timeNs = message.getTimeStampNs();
  if (stamps_ && envelope.timeNs == 0) envelope.timeNs = Clock::wallNs();
  envelope.sentTick = Tick::ofSample(link.timeOfNext());

  const Link::Limits limits{0, first ? 0 : link.slotsOfFirstReplies()};
  const auto bytes = message.body().size();
  const auto result =
      missed ? link.tryRelayFanOut(envelope, chunk, bytes, limits, maxBorrowed_, *missed)
             : link.trySendFanOut(envelope, chunk, bytes, limits, maxBorrowed_);
  if (result != LinkSend::sent) return replyResult(result);
  MPF_STEP(reply_sent);
  if (first) connection.noteFirstReply(route.requestId, counts_);
  counts_.sent();
  link.control().serverSent.store(link.outgoing().messages(), std::memory_order_relaxed);
  if (link.borrowedFanOut() == 1) noteBorrower(connection.channel);
  return ReplyResult::sent;
}

// Remembers a link whose client holds a chunk, so that collectReturned() finds it.
void Publisher::noteBorrower(const std::shared_ptr<MessageLink>& channel) noexcept try {
  const std::lock_guard lock(mutex_);
  std::erase_if(borrowers_, [&](const auto& one) {
    return one.expired() || (!one.owner_before(channel) && !channel.owner_before(one));
  });
  borrowers_.push_back(channel);
  // NOLINTNEXTLINE(bugprone-empty-catch): its returns are taken when the next message is sent to it
} catch (const std::bad_alloc&) {
}

// Takes what the clients have returned since the last message to them.
void Publisher::collectReturned() noexcept try {
  std::vector<std::shared_ptr<MessageLink>> links;
  {
    const std::lock_guard lock(mutex_);
    // First: the last pointer of a link must not end under the mutex.
    links.reserve(borrowers_.size());
    for (const auto& borrower : borrowers_) {
      if (auto link = borrower.lock()) links.push_back(std::move(link));
    }
  }
  for (const auto& link : links) {
    const BiasedLock::Guard lock(link->lock());
    link->link().collectReturned();
  }
  // NOLINTNEXTLINE(bugprone-empty-catch): the caller finds no free chunk
} catch (const std::bad_alloc&) {
}

}  // namespace mpf
