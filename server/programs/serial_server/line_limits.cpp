// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/line_limits.h"

#include <CLI/CLI.hpp>
#include <string>

#include "base/command_line.h"

namespace mpf {
namespace {

constexpr TimeRange kPause{.most = std::chrono::hours(1)};
constexpr TimeRange kRequest{.least = std::chrono::seconds(1), .most = std::chrono::hours(24)};
constexpr int kMostRetries = 1'000'000;

}  // namespace

void LineLimits::addTo(CLI::App& app) {
  addTime(app, "--settle-time", settleTime,
          "How long the line must be silent before a write-read is sent; must be longer than the "
          "pause before an answer that the instrument repeats",
          kPause);
  addTime(
      app, "--quiet-time", quietTime,
      "How long the line must be silent after an answer that was late, damaged or too long; must "
      "be longer than the pauses within an answer",
      kPause);
  addTime(app, "--resync-limit", resyncLimit,
          "How long a late answer is awaited after its timeout; nothing is sent until it has "
          "arrived or this time has passed",
          kPause);
  addTime(app, "--max-timeout", maxTimeout,
          "Longest time that one request may use the line, including retries", kRequest);
  app.add_option("--max-retries", maxRetries, "Highest number of retries of one request")
      ->check(wholeNumber(0, kMostRetries))
      ->capture_default_str();
}

}  // namespace mpf
