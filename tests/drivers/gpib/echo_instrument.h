// SPDX-License-Identifier: MIT
// EchoInstrument: answers each message with the same bytes, and records what the bus does with it.
//
// Threads  any number: the model of a bus uses it on a thread of its own.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "drivers/gpib/instrument_model.h"

namespace mpf::test {

class EchoInstrument final : public GpibInstrumentModel {
 public:
  // --- faults and other behaviour
  std::atomic<bool> acceptsBytes = true;
  std::atomic<bool> isSilent = false;  // has nothing to say
  std::atomic<bool> sendsEnd = true;  // with the last byte of an answer
  std::atomic<bool> neverEnds = false;  // talks without end
  std::atomic<bool> wantsService = false;

  // --- what the bus did
  std::atomic<int> clears = 0;
  std::atomic<int> triggers = 0;
  std::atomic<int> ends = 0;  // messages that ended with END
  std::atomic<Control> control = Control::local;

  // All bytes since the last call.
  std::string takeReceived() {
    const std::lock_guard lock(mutex_);
    return std::exchange(received_, {});
  }
  // Bytes that it sends next, whether or not a message came.
  void say(std::string text) {
    const std::lock_guard lock(mutex_);
    answer_ = std::move(text);
    sent_ = 0;
  }

  bool receive(std::uint8_t byte, bool end) override {
    if (!acceptsBytes) return false;
    const std::lock_guard lock(mutex_);
    received_ += static_cast<char>(byte);
    message_ += static_cast<char>(byte);
    if (!end) return true;
    ++ends;
    answer_ = std::exchange(message_, {});
    sent_ = 0;
    return true;
  }
  std::optional<Byte> nextByte() override {
    if (isSilent) return std::nullopt;
    if (neverEnds) return Byte{.value = 'x'};
    const std::lock_guard lock(mutex_);
    if (sent_ == answer_.size()) return std::nullopt;
    const auto value = static_cast<std::uint8_t>(answer_[sent_++]);
    return Byte{.value = value, .end = sendsEnd && sent_ == answer_.size()};
  }
  [[nodiscard]] bool requestsService() const override { return wantsService; }
  std::uint8_t serialPoll() override { return wantsService.exchange(false) ? 0x41 : 0x01; }
  void clear() override {
    ++clears;
    const std::lock_guard lock(mutex_);
    message_.clear();
    answer_.clear();
    sent_ = 0;
  }
  void trigger() override { ++triggers; }
  void setControl(Control now) override { control = now; }

 private:
  std::mutex mutex_;
  std::string received_;
  std::string message_;
  std::string answer_;
  std::size_t sent_ = 0;
};

inline std::string everyByte() {
  std::string bytes;
  for (int value = 0; value < 256; ++value) bytes += static_cast<char>(value);
  return bytes;
}

// `length` bytes of all values in a changing order.
inline std::string manyBytes(std::size_t length) {
  std::string bytes;
  bytes.reserve(length);
  for (std::uint32_t i = 0; bytes.size() < length; ++i)
    bytes += static_cast<char>((i * 2654435761U) >> 24);
  return bytes;
}

inline std::string textOf(std::span<const std::uint8_t> bytes) {
  return {bytes.begin(), bytes.end()};
}

}  // namespace mpf::test
