// SPDX-License-Identifier: MIT
// Texts and times between kj and the standard library.
#pragma once

#include <chrono>
#include <kj/exception.h>
#include <kj/string.h>
#include <kj/time.h>
#include <string>
#include <string_view>

namespace mpf::router {

[[nodiscard]] inline std::string toStd(kj::StringPtr text) { return {text.begin(), text.size()}; }
// What a peer said, printable() and at most 200 bytes.
[[nodiscard]] std::string forPeople(const std::string& text);
[[nodiscard]] inline std::string forPeople(kj::StringPtr text) { return forPeople(toStd(text)); }

// Why something failed, without the names of kj's variables: "Connection refused" of "connect():
// Connection refused"; kTimeout when a timer ended it.
inline constexpr std::string_view kTimeout = "timeout";
[[nodiscard]] std::string reasonOf(const kj::Exception& error);

[[nodiscard]] inline kj::Duration toKj(std::chrono::nanoseconds time) {
  return time.count() * kj::NANOSECONDS;
}

}  // namespace mpf::router
