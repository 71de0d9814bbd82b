// SPDX-License-Identifier: MIT
// Messages of every type, with values that another byte order would change. The same on every host.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <mpf/message.h>
#include <mpf/user_message.h>

#include "schema/message.capnp.h"

namespace mpf::test {

inline constexpr std::array<double, 7> kHardDoubles{
    -0.0,
    std::bit_cast<double>(std::uint64_t{0xfff4'dead'beef'1234}),  // a signalling NaN with a payload
    std::bit_cast<double>(std::uint64_t{0x7ff8'0000'0000'0001}),  // a quiet one
    std::numeric_limits<double>::denorm_min(),
    -std::numeric_limits<double>::infinity(),
    std::numeric_limits<double>::max(),
    0.1,
};
inline constexpr std::array<std::int32_t, 5> kHardIntegers{INT32_MIN, INT32_MAX, 0, -1, 0x01020304};

template <class Body>
Body withStandardFields(Body body = {}) {
  body.timeout = 0x0a0b0c0d;
  body.cmd = -2;
  body.status = INT32_MIN;
  body.address = INT32_MAX;
  body.extra = 0x00ff00ff;
  return body;
}

// An array with these elements and all its fields filled.
template <ArrayBody Body>
MessageOf<Body> arrayOf(const auto& elements) {
  auto message = MessageOf<Body>::allocValue(elements.size());
  if constexpr (requires { message->cmd; }) {
    const auto length = message->length;
    *message = withStandardFields<Body>();
    message->length = length;
  }
  std::ranges::copy(elements, message.value().begin());
  return message;
}

// A user's own struct; message.capnp is used in place of the user's schema.
inline UserMessage userStruct() {
  UserBuilder builder(UserMessage::allocValue(512));
  auto spectrum = builder.initRoot<wire::Float64Array>();
  spectrum.setAddress(0x01020304);
  auto values = spectrum.initValue(kHardDoubles.size());
  for (unsigned i = 0; i < kHardDoubles.size(); ++i) values.set(i, kHardDoubles[i]);
  return std::move(builder).finish();
}

inline Char8ArrayMessage everyByte() {
  std::array<char, 256> bytes{};
  std::iota(bytes.begin(), bytes.end(), char{0});
  auto message = arrayOf<Char8Array>(bytes);
  message->numberRetrys = 0x01020304;
  message->eomLen = 3;
  message->eomString = {'\r', '\n', '\xff', '\0'};
  return message;
}

// The messages that a client may send.
inline std::vector<Message> everyRequest() {
  std::vector<Message> messages;
  messages.reserve(32);
  for (const auto value : kHardIntegers)
    messages.emplace_back(MessageOf(withStandardFields(Int32{.value = value})));
  for (const auto value : kHardDoubles)
    messages.emplace_back(MessageOf(withStandardFields(Float64{.value = value})));
  messages.emplace_back(arrayOf<Int32Array>(kHardIntegers));
  messages.emplace_back(arrayOf<Float64Array>(kHardDoubles));
  messages.emplace_back(arrayOf<Float64Array>(std::vector<double>{}));
  messages.emplace_back(everyByte());
  messages.emplace_back(MessageOf(SerialConfig{
      .baud = 115200, .stopBits = 2, .bitsPerChar = 7, .parity = 'E', .flowControl = '\xff'}));
  messages.emplace_back(MessageOf(withStandardFields(OutOfBand{.value = 0x01020304})));
  messages.emplace_back(userStruct());
  std::int32_t mark = 0x01020300;
  for (auto& message : messages) {
    message.setClientType(++mark);
    message.setClientExtra(-mark);
  }
  return messages;
}

// The messages that a client may receive: replies with time stamps, and those of MPF itself.
inline std::vector<Message> everyMessage() {
  auto messages = everyRequest();
  for (auto& message : messages) message.setTimeStampNs(0x0102'0304'0506'0708);
  messages.emplace_back(MessageOf(
      Connect{.status = ConnectStatus::connectQueueFull, .incarnation = 0x0102'0304'0506'0708}));
  messages.emplace_back(MessageOf(RequestFate{.fate = Fate::expired, .requestId = 0x01020304}));
  return messages;
}

// Whether both have the same type, client fields, time stamp and bytes.
inline bool isSame(const Message& one, const Message& other) {
  return one.getType() == other.getType() && one.getClientType() == other.getClientType() &&
         one.getClientExtra() == other.getClientExtra() &&
         one.getTimeStampNs() == other.getTimeStampNs() &&
         std::ranges::equal(one.body(), other.body());
}

}  // namespace mpf::test
