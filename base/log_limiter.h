// SPDX-License-Identifier: MIT
// LogLimiter: decides which lines of a log are written now, so that a storm of lines fills no disk.
//
//   line ─► admit() ─ true ──► written now            the first kAtOnce lines of a kind
//                   └ false ─► held: counted, and the last one is kept
//   held lines ─► takeDue() ─► "TEXT (repeated 9968 times in 10.0 s)"    one line of a kind each kEveryNs
//
// Lines of one kind come from one statement of the program, about one object. A kind regains the
// right to one more line each kEveryNs, up to kAtOnce of them. The first line of a storm is written
// at once, the last one with the count of those before it: the written lines and the counts add up
// to all lines.
//
// Threads  one.
// Trust    memory grows with the number of kinds, not with the number or the contents of lines.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace mpf {

class LogLimiter {
 public:
  struct Kind {
    std::string_view file;  // with static lifetime
    std::uint64_t line = 0;  // of the statement in that file
    std::uint64_t object = 0;  // what the statement speaks of; 0: there is only one
    auto operator<=>(const Kind&) const = default;
  };
  struct Line {
    int level = 0;
    std::string text;
  };

  static constexpr std::int64_t kAtOnce = 32;
  static constexpr std::int64_t kEveryNs = 10'000'000'000;

  // True: write the line now. False: it is held, and takeDue() returns it or its count.
  [[nodiscard]] bool admit(const Kind& kind, int level, std::string_view text, std::int64_t nowNs);
  // When takeDue() has something to return; INT64_MAX: nothing is held.
  [[nodiscard]] std::int64_t dueNs() const noexcept { return dueNs_; }
  // A line for each kind whose held lines are due.
  [[nodiscard]] std::vector<Line> takeDue(std::int64_t nowNs) { return take(nowNs, false); }
  // A line for each kind that has held lines: before the program ends.
  [[nodiscard]] std::vector<Line> takeAll(std::int64_t nowNs) { return take(nowNs, true); }

 private:
  struct State {
    // kAtOnce lines are allowed once this lies kAtOnce * kEveryNs back
    std::int64_t usedUntilNs = 0;
    std::uint64_t held = 0;
    bool areAlike = true;  // the texts that are held
    int level = 0;  // the highest of them
    std::string last;
    std::int64_t heldSinceNs = 0;
    [[nodiscard]] std::int64_t nextNs() const noexcept { return usedUntilNs + kEveryNs; }
  };
  std::vector<Line> take(std::int64_t nowNs, bool all);
  static Line summary(State& state, std::int64_t nowNs);

  std::map<Kind, State> states_;
  std::int64_t dueNs_ = INT64_MAX;
};

}  // namespace mpf
