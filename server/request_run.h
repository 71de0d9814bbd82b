// SPDX-License-Identifier: MIT
// RequestRun: waiting requests of one client that a handler gets together.
//
// Threads  plain data.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <mpf/message_types.h>

#include "shm/envelope.h"
#include "shm/messages/value_run.h"

namespace mpf {

class RequestRun {
 public:
  explicit RequestRun(MessageType type) noexcept
      : type_(type), body_(EnvelopeWords::fullSlot(static_cast<std::uint16_t>(type), 0)) {}

  [[nodiscard]] MessageType type() const noexcept { return type_; }

  // Adds a request without its value. Returns false if its type or length differs, or it has a
  // deadline.
  [[nodiscard]] bool tryAdd(const EnvelopeWords& words) noexcept {
    if (words.body != body_ || words.timeNs != 0) return false;
    words_[count_++] = words;
    return true;
  }
  void add(const FirstBody& body) noexcept { values_.add(body); }

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] const EnvelopeWords& operator[](std::size_t index) const noexcept {
    return words_[index];
  }
  [[nodiscard]] std::span<std::byte> values() noexcept { return values_.bytes(); }

 private:
  MessageType type_;
  std::uint64_t body_;
  std::size_t count_ = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): only the first `count_` have a value
  std::array<EnvelopeWords, ValueRun::kMost> words_;
  ValueRun values_;
};

}  // namespace mpf
