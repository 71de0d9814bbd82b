// SPDX-License-Identifier: MIT
// signalName(): a signal as text for people: "SIGSEGV", and "signal 34" for one without a name.
#pragma once

#include <cstring>
#include <fmt/format.h>
#include <string>

namespace mpf {

[[nodiscard]] inline std::string signalName(int number) {
  const char* const name = ::sigabbrev_np(number);  // nullptr for real-time signals
  return name == nullptr ? fmt::format("signal {}", number) : fmt::format("SIG{}", name);
}

}  // namespace mpf
