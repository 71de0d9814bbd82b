// SPDX-License-Identifier: MIT
// Bodies: message bodies to send together. ValueRun: copies of message bodies that were taken
// together.
//
// Threads  plain data.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include <mpf/message_types.h>

#include "shm/envelope.h"

namespace mpf {

// Bodies of `size` bytes each, one after the other.
struct Bodies {
  MessageType type;
  std::size_t size;
  std::span<const std::byte> all;

  [[nodiscard]] bool fillSlots() const noexcept { return size == layout::kFirstSlotBodyBytes; }
  [[nodiscard]] std::size_t count() const noexcept { return all.size() / size; }
  [[nodiscard]] Bodies from(std::size_t index) const noexcept {
    return {type, size, all.subspan(index * size)};
  }
  [[nodiscard]] Bodies first(std::size_t count) const noexcept {
    return {type, size, all.first(count * size)};
  }
};

// Each body fills a slot; the copies lie one after the other.
class ValueRun {
 public:
  static constexpr std::size_t kMost = 16;

  void clear() noexcept { count_ = 0; }
  void add(const FirstBody& body) noexcept { body.copyTo(values_[count_++].data()); }
  // Adds `count` bodies: `body(index)` of each.
  template <class Body>
  [[gnu::always_inline]] void add(std::size_t count, const Body& body) noexcept {
    auto* to = values_[count_].data();
    for (std::size_t index = 0; index < count; ++index, to += values_[0].size())
      body(index).copyTo(to);
    count_ += count;
  }
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] std::span<std::byte> bytes() noexcept {
    return std::as_writable_bytes(std::span(values_).first(count_));
  }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return std::as_bytes(std::span(values_).first(count_));
  }

 private:
  std::size_t count_ = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): only the first `count_` have a value
  alignas(8) std::array<std::array<std::byte, layout::kFirstSlotBodyBytes>, kMost> values_;
};

}  // namespace mpf
