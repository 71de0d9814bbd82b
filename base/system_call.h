// SPDX-License-Identifier: MIT
// System calls: turns their return values into exceptions, and repeats interrupted calls.
#pragma once

#include <cerrno>
#include <string>
#include <string_view>
#include <system_error>

namespace mpf {

// Throws std::system_error "<call> <object>: <reason>" for the errno `code`.
[[noreturn]] inline void throwSystemError(int code, std::string_view call,
                                          std::string_view object) {
  std::string what(call);
  if (!object.empty()) what.append(" ").append(object);
  throw std::system_error(code, std::generic_category(), what);
}

// Returns `result`, or throws std::system_error with errno if `result` is negative. For calls at
// the start of a program, not for the message path.
template <class Result>
Result checkCall(Result result, std::string_view call, std::string_view object = {}) {
  if (result < 0) throwSystemError(errno, call, object);
  return result;
}

// Repeats `call` as long as signal handlers interrupt it (EINTR).
template <class Call>
auto retryInterrupted(Call&& call) noexcept(noexcept(call())) {
  for (;;) {
    const auto result = call();
    if (result >= 0 || errno != EINTR) return result;
  }
}

}  // namespace mpf
