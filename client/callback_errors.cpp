// SPDX-License-Identifier: MIT
#include "client/callback_errors.h"

#include <exception>
#include <fmt/format.h>
#include <utility>

#include <mpf/clock.h>

#include "base/print_error.h"

namespace mpf {
namespace {

std::string textOfException() {
  try {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "not a std::exception";
  }
}

}  // namespace

void CallbackErrors::note(const std::string& server, std::int32_t location) noexcept try {
  client_ = fmt::format(" of the client of server \"{}\" at location {}", server, location);
} catch (const std::exception&) {
  client_.clear();
}

void CallbackErrors::report() noexcept try {
  const auto client = std::exchange(client_, {});
  const auto text = fmt::format(
      "mpf: the callback{} threw an exception: {}. The dispatcher continues; catch the exception "
      "in the callback.",
      client, textOfException());
  if (limiter_.admit({}, 0, text, Clock::nowNs())) write({{0, text}});
  // NOLINTNEXTLINE(bugprone-empty-catch): no memory: the alarm of the dispatcher counts it
} catch (const std::exception&) {
}

void CallbackErrors::writeDue() noexcept try {
  if (dueNs() != INT64_MAX) write(limiter_.takeDue(Clock::nowNs()));
  // NOLINTNEXTLINE(bugprone-empty-catch): as above
} catch (const std::exception&) {
}

void CallbackErrors::writeHeld() noexcept try {
  write(limiter_.takeAll(Clock::nowNs()));
  // NOLINTNEXTLINE(bugprone-empty-catch): as above
} catch (const std::exception&) {
}

void CallbackErrors::write(const std::vector<LogLimiter::Line>& lines) {
  for (const auto& line : lines) printError("{}\n", line.text);
}

}  // namespace mpf
