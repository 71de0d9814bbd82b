// SPDX-License-Identifier: MIT
// SeldomLog: lines of one kind that somebody else can cause, thousands a second if he likes: some at once, then one a second, which says
// how many were left out.
//
// Threads  that of the event loop.
#pragma once

#include <algorithm>
#include <fmt/format.h>
#include <spdlog/logger.h>
#include <string>
#include <utility>

#include <mpf/base/clock.h>

namespace mpf::router {

class SeldomLog {
 public:
  explicit SeldomLog(spdlog::logger& log) : log_(log) {}

  template <class... Arguments>
  void info(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    write(spdlog::level::info, format, std::forward<Arguments>(arguments)...);
  }
  template <class... Arguments>
  void warn(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    write(spdlog::level::warn, format, std::forward<Arguments>(arguments)...);
  }

 private:
  static constexpr std::int64_t kAtOnce = 32;
  static constexpr std::int64_t kEveryNs = 1'000'000'000;

  template <class... Arguments>
  void write(spdlog::level::level_enum level, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    const auto nowNs = Clock::nowNs();
    paidUntilNs_ = std::max(paidUntilNs_, nowNs - kAtOnce * kEveryNs);
    if (paidUntilNs_ + kEveryNs > nowNs) {
      ++leftOut_;
      return;
    }
    paidUntilNs_ += kEveryNs;
    const auto more = leftOut_ == 0 ? std::string() : fmt::format(" ({} lines like this one were left out before it)", leftOut_);
    leftOut_ = 0;
    log_.log(level, "{}{}", fmt::format(format, std::forward<Arguments>(arguments)...), more);
  }

  spdlog::logger& log_;
  std::int64_t paidUntilNs_ = Clock::nowNs() - kAtOnce * kEveryNs;
  std::uint64_t leftOut_ = 0;
};

}  // namespace mpf::router
