// SPDX-License-Identifier: MIT
// ValueHandler: the callback of a client for replies of one scalar type, and the run of values that
// it receives.
//
// Threads  the dispatcher's thread; the handler is set before the client is bound.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>

#include <mpf/message.h>

#include "shm/envelope.h"

namespace mpf {

struct ValueHandler {
  MessageType type = MessageType::none;  // none: there is no handler
  std::size_t size = 0;  // [bytes] of a value
  std::function<void(std::span<const std::byte> values, const Message& first)> callback;
};

// Values that fill a slot each, one after the other.
class ValueRun {
 public:
  static constexpr std::uint64_t kMost = 16;

  void add(const FirstBody& body) noexcept { body.copyTo(values_[count_++].data()); }
  [[nodiscard]] std::span<const std::byte> all() const noexcept {
    return std::as_bytes(std::span(values_).first(count_));
  }

 private:
  std::size_t count_ = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): only the first `count_` have a value
  alignas(8) std::array<std::array<std::byte, layout::kFirstSlotBodyBytes>, kMost> values_;
};

}  // namespace mpf
