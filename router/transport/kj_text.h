// SPDX-License-Identifier: MIT
// Converts texts and times between kj and the standard library.
//
// Threads  any.
#pragma once

#include <chrono>
#include <kj/exception.h>
#include <kj/string.h>
#include <kj/time.h>
#include <string>
#include <string_view>

namespace mpf::router {

[[nodiscard]] inline std::string toStd(kj::StringPtr text) { return {text.begin(), text.size()}; }

// The text of a peer, made printable() and cut to at most 200 bytes.
[[nodiscard]] std::string displayText(const std::string& text);
[[nodiscard]] inline std::string displayText(kj::StringPtr text) {
  return displayText(toStd(text));
}

// The text of reasonOf() after a timeout.
inline constexpr std::string_view kTimeout = "timeout";
// The reason of an error without kj's context: "Connection refused" from "connect(): Connection
// refused".
[[nodiscard]] std::string reasonOf(const kj::Exception& error);

[[nodiscard]] inline kj::Duration toKj(std::chrono::nanoseconds time) {
  return time.count() * kj::NANOSECONDS;
}

}  // namespace mpf::router
