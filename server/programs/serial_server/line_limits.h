// SPDX-License-Identifier: MIT
// LineLimits: how long a request may use a serial line, and how long the line must be silent before
// a write-read is sent.
//
//   --settle-time --quiet-time --resync-limit --max-timeout --max-retries
//
// The reply to a write-read with status 0 has the answer to that write-read, provided that the
// instrument keeps two limits: each answer begins before the timeout of its request plus
// `resyncLimit`, and the pauses within an answer, and between an answer and its repetition, are
// shorter than `settleTime` (after an answer in time) or `quietTime` (after a late one).
#pragma once

#include <algorithm>
#include <chrono>

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
}

namespace mpf {

struct LineLimits {
  std::chrono::milliseconds settleTime{5};  // silence before each write-read
  // The silence instead of it, after an answer that was late, damaged or too long.
  std::chrono::milliseconds quietTime{100};
  std::chrono::milliseconds resyncLimit{1000};  // longest wait for a late answer
  std::chrono::milliseconds maxTimeout{60'000};  // of one request, including its retries
  int maxRetries = 10;

  // The longest wait until a request can be sent.
  [[nodiscard]] std::chrono::milliseconds longestSync() const {
    return resyncLimit + std::max(quietTime, settleTime);
  }
  // Adds the options to `app`, which fills this object and must not outlive it.
  void addTo(CLI::App& app);
};

}  // namespace mpf
