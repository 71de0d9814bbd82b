// SPDX-License-Identifier: MIT
// MessageLink: messages over a link, for client and server: takes a Message out of the ring, sends
// one, and lends pool memory to bodies.
//
// Threads  one thread takes messages. Sending, allocation and the return of bodies: any thread,
//          under the lock that the owner provides.
// Crash    a body stays readable as long as its handle exists, even if the peer has ended.
// Lifetime until the last pointer from make() is gone and the last body has returned.
// Trust    a body that does not fit its envelope is invalid data; the owner then closes the link.
#pragma once

#include <cstring>
#include <memory>
#include <optional>

#include <mpf/message.h>

#include "base/biased_lock.h"
#include "shm/link.h"

namespace mpf {

class MessageLink final : public BodyLender {
 public:
  // The last pointer must not be destroyed under the lock.
  static std::shared_ptr<MessageLink> make(std::unique_ptr<Link> link,
                                           std::shared_ptr<BiasedLock> lock);

  [[nodiscard]] Link& link() noexcept { return *link_; }
  [[nodiscard]] BiasedLock& lock() noexcept { return *lock_; }

  // Whether there is a message to begin.
  [[nodiscard]] bool hasMessage() noexcept { return link_->incoming().hasMessage(); }
  // Begins the next message, after hasMessage(): copies its envelope and counts it as taken.
  // Returns false if the envelope is invalid.
  [[nodiscard]] bool tryBegin(Envelope& envelope) noexcept {
    auto& ring = link_->incoming();
    envelope = ring.begin();
    if (ring.wasIdle()) claimNextLine();
    const bool fitsSlot = ring.hasOneSlot() && isShort(envelope.body());
    return (fitsSlot && hasType(envelope.body())) || isValidLong(envelope.body());
  }
  // Whether the body fits into one slot.
  [[nodiscard]] static bool isShort(BodyFields body) noexcept {
    return (body.flags & layout::kSlotChunk) == 0 && body.bodyBytes <= layout::kFirstSlotBodyBytes;
  }
  // Returns the message begun, whose body isShort(), and frees its slot. Takes route and time stamp
  // because a later change would write these fields twice.
  [[nodiscard]] Message finishShort(const Envelope& envelope, const Route& route,
                                    std::int64_t timeStampNs) noexcept {
    auto& ring = link_->incoming();
    const auto body = ring.firstBody();
    Message message;
    message.assignInline(static_cast<MessageType>(envelope.type), envelope.bodyBytes,
                         {route, envelope.clientType, envelope.clientExtra, timeStampNs},
                         [&](auto bytes) { body.copyTo(bytes.data()); });
    ring.endOneSlot();
    return message;
  }
  // Returns the bytes at layout::kCmdOffset of the body of the message begun, which is not
  // isShort(), without a look at its chunk.
  [[nodiscard]] std::int32_t cmdOfLong(BodyFields body) const noexcept;
  // `invalid`: the body is invalid. `unavailable`: the body cannot be mapped, because its owner
  // has ended or memory is short; the message is lost, but the link is sound.
  enum class Finish { message, invalid, unavailable };
  // Returns the message begun, whose body is not isShort(), and frees its slots. The handle is
  // empty unless `finish` becomes `message`. Adds what the server has dropped to the flags of the
  // route.
  [[nodiscard]] Message finishLong(BodyFields fields, const Message::Attributes& attributes,
                                   Finish& finish) noexcept;
  // Ends the message begun without reading its body; returns its chunk, if it has one.
  void discard(BodyFields body) noexcept;

  // Sends `message`. The caller holds lock(). After a successful send, `message` has no body of
  // this link; the caller destroys it after it has released the lock, because the return of a body
  // of another link may need that lock. If the message was not sent, `message` is unchanged.
  // `envelope()` returns the envelope, as for Link::trySend(). `link` is link(): callers have it,
  // and the compiler would load it again.
  template <class MakeEnvelope>
  [[gnu::always_inline]] LinkSend trySendLocked(Link& link, const MakeEnvelope& envelope,
                                                Message& message, Link::Limits limits) noexcept {
    if (!message.isInline() || message.body().size() > layout::kFirstSlotBodyBytes)
      return trySendLongLocked(envelope(), message, limits);
    return link.trySend(envelope, message.body(), limits);
  }

  // Allocates a body in the pool of this link; without data if the body is short or the pool has no
  // chunk for it. The caller holds lock().
  [[nodiscard]] BodyBytes tryAllocateLocked(std::size_t bytes) noexcept;
  void takeBack(std::byte* data, std::size_t capacity) noexcept override;

 private:
  MessageLink(std::unique_ptr<Link> link, std::shared_ptr<BiasedLock> lock)
      : link_(std::move(link)), lock_(std::move(lock)) {}
  ~MessageLink() = default;
  // Fetches the line of the next message that is sent, while the one begun is handled.
  [[gnu::always_inline]] void claimNextLine() noexcept {
    lock_->ifBiased([this] { link_->outgoing().claimNext(); });
  }
  // The last pointer is gone.
  void leave() noexcept;
  [[nodiscard]] static bool hasType(BodyFields body) noexcept {
    return body.type != static_cast<std::uint16_t>(MessageType::none);
  }
  [[nodiscard]] bool isValidLong(BodyFields body) const noexcept;
  Message readBody(BodyFields fields, const Message::Attributes& attributes,
                   Finish& finish) noexcept;
  // For a body in a chunk.
  //   throws  ChunkUnavailable
  Message readChunk(BodyFields fields, const Message::Attributes& attributes, Finish& finish);
  // For a message that does not fit into one slot.
  LinkSend trySendLongLocked(const Envelope& envelope, Message& message,
                             Link::Limits limits) noexcept;

  std::unique_ptr<Link> link_;
  std::shared_ptr<BiasedLock> lock_;
  std::uint32_t lent_ = 0;  // bodies that have not been returned; under lock_
  bool isOwned_ = true;  // a pointer from make() exists; under lock_
};

}  // namespace mpf
