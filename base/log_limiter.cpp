// SPDX-License-Identifier: MIT
#include "base/log_limiter.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

namespace mpf {

// While lines of a kind are held, each further line of this kind is held too.
bool LogLimiter::admit(const Kind& kind, int level, std::string_view text, std::int64_t nowNs) {
  constexpr auto kFullNs = kAtOnce * kEveryNs;
  auto& state =
      states_.try_emplace(kind, State{.usedUntilNs = nowNs - kFullNs, .last = {}}).first->second;
  state.usedUntilNs = std::max(state.usedUntilNs, nowNs - kFullNs);
  if (state.held == 0 && state.nextNs() <= nowNs) {
    state.usedUntilNs += kEveryNs;
    return true;
  }
  if (state.held == 0) {
    state.heldSinceNs = nowNs;
    state.areAlike = true;
    state.level = level;
  } else {
    state.areAlike = state.areAlike && state.last == text;
    state.level = std::max(state.level, level);
  }
  ++state.held;
  state.last = text;
  dueNs_ = std::min(dueNs_, state.nextNs());
  return false;
}

LogLimiter::Line LogLimiter::summary(State& state, std::int64_t nowNs) {
  const auto held = std::exchange(state.held, 0);
  auto text = std::exchange(state.last, {});
  if (held != 1) {
    text += fmt::format(" ({} {} {} in {:.1f} s)", state.areAlike ? "repeated" : "the last of",
                        held, state.areAlike ? "times" : "such lines",
                        static_cast<double>(nowNs - state.heldSinceNs) / 1e9);
  }
  return {state.level, std::move(text)};
}

// Also erases each kind that may write its full number of lines again.
std::vector<LogLimiter::Line> LogLimiter::take(std::int64_t nowNs, bool all) {
  constexpr auto kFullNs = kAtOnce * kEveryNs;
  std::vector<Line> lines;
  dueNs_ = INT64_MAX;
  for (auto each = states_.begin(); each != states_.end();) {
    auto& state = each->second;
    if (state.held != 0 && !all && state.nextNs() > nowNs) {
      dueNs_ = std::min(dueNs_, state.nextNs());
    } else if (state.held != 0) {
      state.usedUntilNs = std::max(state.nextNs(), nowNs - kFullNs);
      lines.push_back(summary(state, nowNs));
    } else if (state.usedUntilNs + kFullNs <= nowNs) {
      each = states_.erase(each);
      continue;
    }
    ++each;
  }
  return lines;
}

}  // namespace mpf
