// SPDX-License-Identifier: MIT
#include "shm/messages/message_link.h"

#include <array>
#include <cstddef>

#include "shm/private_pages.h"

namespace mpf {

std::shared_ptr<MessageLink> MessageLink::make(std::unique_ptr<Link> link,
                                               std::shared_ptr<BiasedLock> lock) {
  return {new MessageLink(std::move(link), std::move(lock)), [](auto* one) { one->leave(); }};
}

void MessageLink::leave() noexcept {
  // In a forked child, a thread that does not exist there may hold the lock for ever.
  if (!link_->isInherited()) {
    const BiasedLock::Guard guard(*lock_);
    isOwned_ = false;
    if (lent_ != 0) return;
  } else if (lent_ != 0) {
    return;
  }
  delete this;
}

// tryBegin() itself accepts a short body with a type in one slot.
bool MessageLink::isValidLong(BodyFields body) const noexcept {
  if (isShort(body) || !hasType(body)) return false;
  const auto room = link_->incoming().inlineCapacity();
  const bool isChunk = (body.flags & layout::kSlotChunk) != 0;
  return room != 0 && body.bodyBytes <= (isChunk ? link_->maxMessageBytes() : room);
}

std::int32_t MessageLink::cmdOfLong(BodyFields body) const noexcept {
  std::array<std::byte, layout::kFirstSlotBodyBytes> bytes;
  link_->incoming().firstBody().copyTo(bytes.data());
  const bool isChunk = (body.flags & layout::kSlotChunk) != 0;
  std::int32_t cmd = 0;
  const auto at = isChunk ? offsetof(layout::ChunkRef, cmd) : layout::kCmdOffset;
  std::memcpy(&cmd, bytes.data() + at, sizeof cmd);
  return cmd;
}

// This and readBody() are inline in finishLong(): copies of a chunk or of attributes that another
// function has stored would wait for the stores.
[[gnu::always_inline]] inline Message MessageLink::readChunk(BodyFields fields,
                                                             const Message::Attributes& attributes,
                                                             Finish& finish) {
  std::optional<Chunk> chunk;
  {
    const BiasedLock::Guard guard(*lock_);
    chunk = link_->tryChunk(fields.bodyBytes);
    if (chunk) ++lent_;
  }
  if (!chunk) {
    finish = Finish::invalid;
    return {};
  }
  const auto type = static_cast<MessageType>(fields.type);
  const BodyBytes body{chunk->data, fields.bodyBytes, chunk->capacity, this};
  if (!chunk->isFanOut) return Message::adopt(type, body, attributes);
  // The program may have written to the last message in this mapping. Without the lock, because
  // this takes longer than anything else.
  private_pages::drop(chunk->data, chunk->capacity);
  auto shared = attributes;
  shared.route.flags |= Message::missedFlags(chunk->missed);
  return Message::adopt(type, body, shared);
}

[[gnu::always_inline]] inline Message MessageLink::readBody(BodyFields fields,
                                                            const Message::Attributes& attributes,
                                                            Finish& finish) noexcept try {
  const auto type = static_cast<MessageType>(fields.type);
  finish = Finish::message;
  if ((fields.flags & layout::kSlotChunk) != 0) return readChunk(fields, attributes, finish);
  if (fields.bodyBytes <= Message::kInlineBytes) {
    Message message;
    message.assignInline(type, fields.bodyBytes, attributes, [&](auto body) {
      link_->incoming().copyBody(body.first(fields.bodyBytes));
    });
    return message;
  }
  auto body = allocateHeapBody(layout::kInlineBodyBytes);
  body.size = fields.bodyBytes;
  link_->incoming().copyBody({body.data, body.size});
  return Message::adopt(type, body, attributes);
} catch (const ChunkUnavailable&) {
  finish = Finish::unavailable;
  return {};
} catch (const std::bad_alloc&) {
  finish = Finish::unavailable;
  return {};
}

Message MessageLink::finishLong(BodyFields fields, const Message::Attributes& attributes,
                                Finish& finish) noexcept {
  auto message = readBody(fields, attributes, finish);
  link_->incoming().end();
  return message;
}

void MessageLink::discard(BodyFields body) noexcept {
  try {
    if ((body.flags & layout::kSlotChunk) != 0) {
      const BiasedLock::Guard guard(*lock_);
      if (const auto chunk = link_->tryChunk(body.bodyBytes)) link_->release(chunk->data);
    }
    // NOLINTNEXTLINE(bugprone-empty-catch): tryChunk() has returned the chunk to the peer
  } catch (const ChunkUnavailable&) {
  }
  link_->incoming().end();
}

LinkSend MessageLink::trySendLongLocked(const Envelope& envelope, Message& message,
                                        Link::Limits limits) noexcept {
  const bool ours = message.lender() == this;
  const auto result = link_->trySend(envelope, message.body(), limits);
  if (result == LinkSend::sentInPlace) {
    static_cast<void>(message.releaseBody());
    if (ours) --lent_;
  } else if (result == LinkSend::sent && ours) {
    // The body was copied into the ring, so the chunk is free. Released here, because takeBack()
    // would lock the lock that the caller holds already.
    const auto body = message.releaseBody();
    link_->release(body.data);
    --lent_;
  }
  return result;
}

BodyBytes MessageLink::tryAllocateLocked(std::size_t bytes) noexcept {
  if (bytes <= layout::kInlineBodyBytes) return {};
  const auto chunk = link_->tryAlloc(bytes);
  if (!chunk) return {};
  ++lent_;
  return BodyBytes{chunk->data, bytes, chunk->capacity, this};
}

void MessageLink::takeBack(std::byte* data, std::size_t) noexcept {
  if (link_->isInherited()) return;  // as in leave()
  {
    const BiasedLock::Guard guard(*lock_);
    link_->release(data);
    if (--lent_ != 0 || isOwned_) return;
  }
  delete this;
}

}  // namespace mpf
