// SPDX-License-Identifier: MIT
// PlainForms: how PlainRun arranges the items of a frame; found in the schema, once.
//
// Threads  any number of callers at a time.
// Throws   the first get() throws kj::Exception if the schema does not fit: a defect that each test
//          of a router finds.
#pragma once

#include <array>
#include <capnp/common.h>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>

#include <mpf/message_types.h>

#include "shm/messages/message_run.h"

namespace mpf::router {

// Calls `act` with the type of a plain message of this number. Returns false for other types.
template <class Act>
constexpr bool withPlainType(MessageType type, Act&& act) {
  switch (type) {
    case MessageType::int32:
      return act(std::type_identity<Int32>());
    case MessageType::float64:
      return act(std::type_identity<Float64>());
    case MessageType::outOfBand:
      return act(std::type_identity<OutOfBand>());
    case MessageType::serialConfig:
      return act(std::type_identity<SerialConfig>());
    default:
      return false;
  }
}

// Every type that MessageRun can hold is plain.
template <class... T>
constexpr bool areRunsPlain(std::type_identity<std::tuple<T...>> /*types*/) {
  return ((!MessageRun::canHold(T::kType) || withPlainType(T::kType, [](auto) { return true; })) &&
          ...);
}
static_assert(areRunsPlain(std::type_identity<MessageTypes>()));

inline constexpr std::size_t kWordBytes = sizeof(capnp::word);

// The pointer to a struct that begins `offset` words after it.
constexpr std::uint64_t structPointer(std::int64_t offset, std::size_t dataWords,
                                      std::size_t pointers) noexcept {
  return (static_cast<std::uint64_t>(offset) << 2 & UINT32_MAX) | std::uint64_t{dataWords} << 32 |
         std::uint64_t{pointers} << 48;
}
// The word in the byte order of the wire.
[[nodiscard]] std::uint64_t toLittle(std::uint64_t value) noexcept;

// One item, whose Request or Reply, Envelope and message follow one another.
struct PlainForm {
  static constexpr std::size_t kMostWords = 16;
  static constexpr std::size_t kMostFields = 6;

  std::array<std::uint64_t, kMostWords> words{};  // of an item whose numbers are 0
  std::size_t count = 0;  // of the words; 0: the type is not plain
  std::size_t toEnvelope = 0, toMessage = 0;  // words that are pointers
  // Bytes of the numbers, from the beginning of the item.
  std::size_t client = 0, requestId = 0, clientType = 0, clientExtra = 0, timeStamp = 0;
  std::size_t takeWithin = 0;  // of a request
  std::size_t isFirstBit = 0, missed = 0;  // of a reply
  std::array<std::size_t, kMostFields> fields{};  // of the message
};

struct PlainForms {
  [[nodiscard]] static const PlainForms& get() {
    static const PlainForms forms;
    return forms;
  }

  // Requests, or replies.
  struct Kind {
    std::uint16_t number = 0;  // of the item
    std::uint64_t shape = 0;  // upper half of the pointer to the Request or Reply
    std::size_t typeByte = 0;  // of the number of its type in an item
    std::size_t wordsWithoutMessage = 0;
    std::array<PlainForm, std::tuple_size_v<MessageTypes> + 1> forms{};  // by MessageType
  };
  Kind request, reply;
  [[nodiscard]] const Kind& kind(bool isRequest) const noexcept {
    return isRequest ? request : reply;
  }

  std::uint64_t root = 0;  // the pointer to the Frame
  std::size_t frameWords = 0;
  std::size_t list = 0;  // word of the pointer to the list of items
  std::size_t itemData = 0, itemPointers = 0;  // words of an item in the list
  std::size_t kindByte = 0;  // in the list
  std::size_t itemPointer = 0;  // the pointer to its Request or Reply

 private:
  PlainForms();
};

}  // namespace mpf::router
