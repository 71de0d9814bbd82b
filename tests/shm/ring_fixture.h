// SPDX-License-Identifier: MIT
// RingTest: a ring in plain memory, between guard slots that must not change.
#pragma once

#include <algorithm>
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <vector>

#include "shm/ring.h"

namespace mpf::test {

using Bytes = std::vector<std::byte>;

// `size` bytes with values computed from `ordinal`.
inline Bytes pattern(std::uint64_t ordinal, std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(ordinal * 31 + i);
  return bytes;
}

class RingTest : public testing::Test {
 protected:
  static constexpr std::uint32_t kCapacity = 16;
  static constexpr std::uint32_t kGuards = 4;

  RingTest() {
    for (auto* guard : guards()) std::fill_n(guard, kGuardBytes, kGuard);
  }
  ~RingTest() override {
    for (const auto* guard : guards()) {
      EXPECT_TRUE(std::all_of(guard, guard + kGuardBytes, [](auto byte) { return byte == kGuard; }))
          << "a write outside the ring";
    }
  }
  // The memory of the ring's slots.
  std::byte* ringBytes() { return bytes(kGuards); }

  bool push(std::uint64_t ordinal, std::size_t bodyBytes = 8) {
    const Envelope envelope{.bodyBytes = static_cast<std::uint32_t>(bodyBytes),
                            .requestId = static_cast<std::uint32_t>(ordinal)};
    return producer_.tryPush(envelope, pattern(ordinal, bodyBytes));
  }
  // Takes the next message and returns its body.
  Bytes take() {
    const auto envelope = consumer_.begin();
    Bytes body(std::min<std::size_t>(envelope.bodyBytes, consumer_.inlineCapacity()));
    consumer_.copyBody(body);
    consumer_.end();
    return body;
  }

 private:
  static constexpr std::byte kGuard{0xa5};
  static constexpr std::size_t kGuardBytes = kGuards * sizeof(layout::Slot);
  std::array<std::byte*, 2> guards() { return {bytes(0), bytes(kGuards + kCapacity)}; }
  std::byte* bytes(std::uint32_t slot) { return reinterpret_cast<std::byte*>(slots_.get() + slot); }
  std::unique_ptr<layout::Slot[]> slots_ =
      std::make_unique<layout::Slot[]>(kCapacity + 2 * kGuards);

 protected:
  layout::Slot* ring_ = slots_.get() + kGuards;
  layout::RingControl control_{};
  RingProducer producer_{ring_, kCapacity, control_};
  RingConsumer consumer_{ring_, kCapacity, control_};
};

}  // namespace mpf::test
