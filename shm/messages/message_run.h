// SPDX-License-Identifier: MIT
// MessageRun: messages of one type that are taken or sent together, with the envelope of each. The
// time in an envelope is the time stamp of a reply; requests in a run have no deadline.
//
// Threads  plain data.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <mpf/message.h>
#include <mpf/message_layout.h>

#include "shm/envelope.h"
#include "shm/messages/value_run.h"

namespace mpf {

class MessageRun {
 public:
  static constexpr std::size_t kMost = ValueRun::kMost;
  // Whether the bodies of this type fill a slot each. Only such messages may be in a run.
  [[nodiscard]] static constexpr bool canHold(MessageType type) noexcept {
    const auto& body = layoutOf(type);
    return body.headerBytes == layout::kFirstSlotBodyBytes && body.elementBytes == 0;
  }

  MessageRun() noexcept : MessageRun(MessageType::none) {}
  //   flags  of the slot of each message
  explicit MessageRun(MessageType type, std::uint8_t flags = 0) noexcept { begin(type, flags); }

  // Empties the run, for messages of this type.
  void begin(MessageType type, std::uint8_t flags = 0) noexcept {
    type_ = type;
    body_ = EnvelopeWords::fullSlot(static_cast<std::uint16_t>(type), flags);
    count_ = 0;
    values_.clear();
  }

  [[nodiscard]] MessageType type() const noexcept { return type_; }
  [[nodiscard]] bool isFull() const noexcept { return count_ == kMost; }

  // Whether these words may be added: the type, the length and the flags are those of the run.
  [[nodiscard]] bool accepts(const EnvelopeWords& words) const noexcept {
    return words.body == body_;
  }
  // Adds a message: first its envelope, then its body. The envelopes of several messages may come
  // before their bodies. The run must not be full.
  void add(const EnvelopeWords& words) noexcept { words_[count_++] = words; }
  void add(const FirstBody& body) noexcept { values_.add(body); }
  template <class Body>
  void add(std::size_t count, const Body& body) noexcept {
    values_.add(count, body);
  }

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] const EnvelopeWords& operator[](std::size_t index) const noexcept {
    return words_[index];
  }
  // The bodies, one after the other.
  [[nodiscard]] std::span<std::byte> values() noexcept { return values_.bytes(); }
  [[nodiscard]] std::span<const std::byte> values(std::size_t from,
                                                  std::size_t count) const noexcept {
    return values_.bytes().subspan(from * layout::kFirstSlotBodyBytes,
                                   count * layout::kFirstSlotBodyBytes);
  }
  // A copy of a message, without a route.
  [[nodiscard]] Message message(std::size_t index) const {
    const auto& words = words_[index];
    auto message = Message::copyInline(type_, values(index, 1));
    message.setClientType(words.clientType());
    message.setClientExtra(words.clientExtra());
    message.setTimeStampNs(static_cast<std::int64_t>(words.timeNs));
    return message;
  }

 private:
  MessageType type_{};
  std::uint64_t body_ = 0;
  std::size_t count_ = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): only the first `count_` have a value
  std::array<EnvelopeWords, kMost> words_;
  ValueRun values_;
};

}  // namespace mpf
