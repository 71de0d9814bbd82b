// SPDX-License-Identifier: MIT
// The protocol between mpf_test_ask and mpf_test_echo: Int32 messages that are commands to the
// echo, and lines that both print for the test.
#pragma once

#include <cstdint>
#include <cstdio>
#include <fmt/format.h>
#include <optional>

#include <mpf/message_of.h>

namespace mpf::test {

enum class Command : std::int32_t {
  sendOutOfBand = 0x01020301,  // an OutOfBand message before the reply
  refuse,
  stall,  // replies, and then takes no messages until SIGUSR1
  die,
};
inline constexpr std::int32_t kQueueSize = 4;
// The time stamp of each echo.
inline constexpr std::int64_t kEchoStamp = 0x0102'0304'0506'0708;

inline Int32Message toMessage(Command command) {
  return Int32Message({.cmd = static_cast<std::int32_t>(command)});
}
inline std::optional<Command> toCommand(const Message& message) {
  const auto* body = message.tryAs<Int32>();
  if (body == nullptr || body->cmd < static_cast<std::int32_t>(Command::sendOutOfBand))
    return std::nullopt;
  return static_cast<Command>(body->cmd);
}

// Prints a line for the test.
template <class... Arguments>
void say(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  fmt::print(stderr, "{}\n", fmt::format(text, std::forward<Arguments>(arguments)...));
}

}  // namespace mpf::test
