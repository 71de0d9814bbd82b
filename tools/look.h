// SPDX-License-Identifier: MIT
// Look: two surveys with some time between them, which tell what one cannot: rates, and who has stopped moving.
//
// Threads  one.
#pragma once

#include <chrono>
#include <string>

#include <mpf/tools/survey.h>

namespace mpf::tools {

struct Rates {
  double sentPerSecond = 0;
  double receivedPerSecond = 0;
};

class Look {
 public:
  // Surveys now, and again after `interval`.
  Look(const std::string& backplane, std::chrono::milliseconds interval);
  Look(Survey before, Survey now) : before_(std::move(before)), now_(std::move(now)) {}

  [[nodiscard]] const Survey& now() const noexcept { return now_; }
  // Messages of a window in either direction. Client windows: requests sent, replies received.
  [[nodiscard]] Rates ratesOf(const WindowView& window) const noexcept;
  // "alive", "closed", "dead"; of the living "stalled" when messages wait for it and it took none between the surveys, and "stopped"
  // when its process is, by a signal or a debugger.
  [[nodiscard]] std::string stateOf(const WindowView& window) const;

 private:
  [[nodiscard]] bool isStalled(const WindowView& window) const noexcept;
  Survey before_;
  Survey now_;
};

// What goes into a window and what comes out of it, over all of its links.
struct Totals {
  Traffic incoming;  // a server's requests, a client's replies
  Traffic outgoing;
  std::uint64_t refused = 0, unanswered = 0, bytes = 0;
  static Totals of(const WindowView& window) noexcept;
};

}  // namespace mpf::tools
