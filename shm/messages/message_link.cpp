// SPDX-License-Identifier: MIT
#include "shm/messages/message_link.h"

#include "shm/private_pages.h"

namespace mpf {

// tryBegin() itself accepts a short body with a type in one slot.
bool MessageLink::isValidLong(BodyFields body) const noexcept {
  if (isShort(body) || !hasType(body)) return false;
  const auto room = link_->incoming().inlineCapacity();
  const bool isChunk = (body.flags & layout::kSlotChunk) != 0;
  return room != 0 && body.bodyBytes <= (isChunk ? link_->maxMessageBytes() : room);
}

MessageLink::Finish MessageLink::tryFinishLong(BodyFields fields, RequestMarks marks,
                                               Message& message) noexcept {
  const auto finish = readBody(fields, message);
  link_->incoming().end();
  if (!message) return finish == Finish::message ? Finish::invalid : finish;
  message.setClientType(marks.clientType);
  message.setClientExtra(marks.clientExtra);
  return finish;
}

MessageLink::Finish MessageLink::readBody(BodyFields fields, Message& message) noexcept try {
  const auto type = static_cast<MessageType>(fields.type);
  message.reset();
  if ((fields.flags & layout::kSlotChunk) != 0) {
    message = readChunk(fields);
  } else if (fields.bodyBytes <= Message::kInlineBytes) {
    message.assignInline(type, fields.bodyBytes, {}, [&](auto body) {
      link_->incoming().copyBody(body.first(fields.bodyBytes));
    });
  } else {
    auto body = allocateHeapBody(layout::kInlineBodyBytes);
    body.size = fields.bodyBytes;
    link_->incoming().copyBody({body.data, body.size});
    message = Message::adopt(type, body);
  }
  return Finish::message;
} catch (const ChunkUnavailable&) {
  return Finish::unavailable;
} catch (const std::bad_alloc&) {
  return Finish::unavailable;
}

Message MessageLink::readChunk(BodyFields fields) {
  std::optional<Chunk> chunk;
  {
    const BiasedLock::Guard guard(*lock_);
    chunk = link_->tryChunk(fields.bodyBytes);
    if (!chunk) return {};
    lendOne();
  }
  const bool isFanOut = chunk->ref.side == layout::kFanOutSide;
  // The program may have written to the last message in this mapping. Without the lock, because
  // this takes longer than anything else.
  if (isFanOut) private_pages::drop(chunk->data, chunk->capacity);
  auto message = Message::adopt(static_cast<MessageType>(fields.type),
                                {chunk->data, fields.bodyBytes, chunk->capacity, this});
  if (isFanOut) message.setRoute({0, 0, Message::missedFlags(chunk->ref.missed), nullptr});
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

LinkSend MessageLink::trySendLongLocked(Envelope envelope, Message& message,
                                        Link::Limits limits) noexcept {
  const bool ours = message.lender() == this;
  const auto result = link_->trySend(envelope, message.body(), limits);
  if (result == LinkSend::sentInPlace) {
    static_cast<void>(message.releaseBody());
    if (ours) endLending();
  } else if (result == LinkSend::sent && ours) {
    // The body was copied into the ring, so the chunk is free. Released here, because takeBack()
    // would lock the lock that the caller holds already.
    const auto body = message.releaseBody();
    link_->release(body.data);
    endLending();
  }
  return result;
}

BodyBytes MessageLink::allocate(std::size_t bytes) {
  {
    const BiasedLock::Guard guard(*lock_);
    if (bytes > layout::kInlineBodyBytes) {
      if (const auto chunk = link_->tryAlloc(bytes)) {
        lendOne();
        return {chunk->data, bytes, chunk->capacity, this};
      }
    }
  }
  return allocateHeapBody(bytes);
}

void MessageLink::takeBack(std::byte* data, std::size_t) noexcept {
  std::shared_ptr<MessageLink> last;  // destroyed after the guard; may destroy this object
  const auto lock = lock_;
  const BiasedLock::Guard guard(*lock);
  link_->release(data);
  if (lent_ == 1) last = self_;
  endLending();
}

void MessageLink::lendOne() noexcept {
  if (lent_++ == 0) self_ = shared_from_this();
}

void MessageLink::endLending() noexcept {
  if (--lent_ == 0) self_.reset();
}

}  // namespace mpf
