// SPDX-License-Identifier: MIT
#include "client/callback_errors.h"

#include <cstdio>
#include <exception>
#include <fmt/format.h>
#include <utility>

#include <mpf/clock.h>

namespace mpf {
namespace {

constexpr std::int64_t kReportEveryNs = 1'000'000'000;

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
  const auto nowNs = Clock::nowNs();
  if (reportedNs_ != 0 && nowNs - reportedNs_ < kReportEveryNs) {
    ++leftOut_;
    return;
  }
  reportedNs_ = nowNs;
  const auto leftOut = std::exchange(leftOut_, 0);
  const auto more = leftOut == 0 ? "" : fmt::format(" ({} more since the last report)", leftOut);
  const auto text = fmt::format(
      "mpf: the callback{} threw an exception: {}. The dispatcher continues; catch the exception "
      "in the "
      "callback.{}\n",
      client, textOfException(), more);
  std::fwrite(text.data(), 1, text.size(), stderr);
} catch (const std::exception&) {
  ++leftOut_;  // no memory for the text
}

}  // namespace mpf
