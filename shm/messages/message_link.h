// SPDX-License-Identifier: MIT
// MessageLink: messages over a link. What both ends share: taking a Message out of the ring,
// putting one in, lending pool memory.
//
// Threads  one thread takes. trySend, alloc and the return of bodies: any thread, under a lock that
//          the owner gives.
// Crash    a body stays readable for as long as its handle lives, whatever became of the peer.
// Trust    a body that does not fit its envelope is nonsense; the owner then closes the link.
#pragma once

#include <memory>
#include <optional>

#include <mpf/message.h>

#include "base/spin_lock.h"
#include "shm/link.h"

namespace mpf {

class MessageLink final : public BodyLender, public std::enable_shared_from_this<MessageLink> {
 public:
  MessageLink(std::unique_ptr<Link> link, std::shared_ptr<SpinLock> lock)
      : link_(std::move(link)), lock_(std::move(lock)) {}

  [[nodiscard]] Link& link() noexcept { return *link_; }
  [[nodiscard]] SpinLock& lock() noexcept { return *lock_; }

  enum class Take { nothing, message, invalid };
  // Begins the next message: its envelope is copied and it counts as taken. `nothing` changes
  // nothing.
  Take tryBegin(Envelope& envelope) noexcept {
    if (!link_->hasMessage()) return Take::nothing;
    envelope = link_->begin();
    const auto room = link_->inlineCapacity();
    const bool isChunk = (envelope.flags & layout::kSlotChunk) != 0;
    return room != 0 && envelope.bodyBytes <= (isChunk ? link_->maxMessageBytes() : room)
               ? Take::message
               : Take::invalid;
  }
  // `unavailable`: the memory of the body went with its owner, or cannot be had now. The message is
  // lost, and the link is sound.
  enum class Finish { message, invalid, unavailable };
  // The body of the message begun into `message`, then done with its slots. `message` is empty when
  // there is none.
  [[nodiscard]] Finish tryFinish(const Envelope& envelope, Message& message) noexcept {
    auto finish = Finish::message;
    if ((envelope.flags & layout::kSlotChunk) == 0 &&
        envelope.bodyBytes <= layout::kFirstSlotBodyBytes) {
      message.assignInline(
          static_cast<MessageType>(envelope.type), envelope.bodyBytes,
          [&](auto body) { link_->copyFirst(body.template first<layout::kFirstSlotBodyBytes>()); });
    } else {
      finish = readBody(envelope, message);
    }
    link_->end();
    if (!message) return finish == Finish::message ? Finish::invalid : finish;
    message.setClientType(envelope.clientType);
    message.setClientExtra(envelope.clientExtra);
    return finish;
  }
  // Done with the message begun without looking at its body; a chunk goes back.
  void discard(const Envelope& envelope) noexcept;

  // Sends. Afterwards `message` has no body of this link any more; what is left of it the caller
  // destroys without the lock, which the return of a body would want. When it was not sent,
  // `message` is as it was. The caller holds lock().
  LinkSend trySendLocked(Envelope& envelope, Message& message, const Link::Limits& limits) noexcept;

  // Memory of this link to build a body in; the heap's when the link has none for it.
  //   throws  std::bad_alloc
  BodyBytes allocate(std::size_t bytes);
  void takeBack(std::byte* data, std::size_t capacity) noexcept override;

 private:
  // Of a message that is more than one slot can hold.
  Finish readBody(const Envelope& envelope, Message& message) noexcept;
  void lendOne() noexcept;
  void endLending() noexcept;

  std::unique_ptr<Link> link_;
  std::shared_ptr<SpinLock> lock_;
  std::uint32_t lent_ = 0;  // bodies out; under lock_
  std::shared_ptr<MessageLink> self_;  // while bodies are out; under lock_
};

}  // namespace mpf
