// SPDX-License-Identifier: MIT
// LogLimiter: decides which log lines are written now, so that repeated lines cannot fill a disk.
//
//   line ─► admit() ─ true ──► written now       the first kAtOnce lines of a kind
//                   └ false ─► held: counted, and the last one is kept
//   held lines ─► takeDue() ─► "TEXT (repeated 9968 times in 10.0 s)"
//                              one line of each kind every kEveryNs
//
// A kind is one log statement of the program about one object. Every kEveryNs a kind may write one
// more line, up to kAtOnce lines. The first lines of a series are written at once; the last line
// is written with the number of held lines. The written lines and these numbers add up to all
// lines.
//
// Threads  one thread.
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
    std::uint64_t object = 0;  // the object that the line is about; 0: there is only one
    auto operator<=>(const Kind&) const = default;
  };
  struct Line {
    int level = 0;
    std::string text;
  };

  static constexpr std::int64_t kAtOnce = 32;
  static constexpr std::int64_t kEveryNs = 10'000'000'000;

  // Returns true if the line must be written now. Otherwise the line is held: takeDue() later
  // returns it or includes it in a count.
  [[nodiscard]] bool admit(const Kind& kind, int level, std::string_view text, std::int64_t nowNs);
  // The time at which takeDue() next returns a line; INT64_MAX if no line is held.
  [[nodiscard]] std::int64_t dueNs() const noexcept { return dueNs_; }
  // Returns a line for each kind whose held lines are due.
  [[nodiscard]] std::vector<Line> takeDue(std::int64_t nowNs) { return take(nowNs, false); }
  // Returns a line for each kind that has held lines. For the end of the program.
  [[nodiscard]] std::vector<Line> takeAll(std::int64_t nowNs) { return take(nowNs, true); }

 private:
  struct State {
    // Each written line adds kEveryNs. When this time is kAtOnce * kEveryNs ago, kAtOnce lines are
    // allowed at once.
    std::int64_t usedUntilNs = 0;
    std::uint64_t held = 0;  // number of held lines
    bool areAlike = true;  // all held lines have the same text
    int level = 0;  // the highest level of the held lines
    std::string last;  // text of the last held line
    std::int64_t heldSinceNs = 0;
    [[nodiscard]] std::int64_t nextNs() const noexcept { return usedUntilNs + kEveryNs; }
  };
  std::vector<Line> take(std::int64_t nowNs, bool all);
  static Line summary(State& state, std::int64_t nowNs);

  std::map<Kind, State> states_;
  std::int64_t dueNs_ = INT64_MAX;
};

}  // namespace mpf
