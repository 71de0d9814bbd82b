// SPDX-License-Identifier: MIT
// System calls: what to do with their return values.
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

// Returns `result`, or throws when the call answered with a negative one. For the environment at
// start, not for the message path.
template <class Result>
Result checkCall(Result result, std::string_view call, std::string_view object = {}) {
  if (result < 0) throwSystemError(errno, call, object);
  return result;
}

// Repeats `call` while a signal handler interrupted it.
template <class Call>
auto retryInterrupted(Call&& call) noexcept(noexcept(call())) {
  for (;;) {
    const auto result = call();
    if (result >= 0 || errno != EINTR) return result;
  }
}

}  // namespace mpf
