// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/line_limits.h"

#include <CLI/CLI.hpp>
#include <string>

#include "base/command_line.h"

namespace mpf {
namespace {

constexpr int kLongestMs = 3'600'000;
constexpr int kLongestSeconds = 86'400;
constexpr int kMostRetries = 1'000'000;

template <class Duration>
void addTime(CLI::App& app, const std::string& option, Duration& time, int least, int most,
             const std::string& help) {
  app.add_option_function<int>(
         option, [&time](int value) { time = Duration(value); }, help)
      ->check(wholeNumber(static_cast<std::uint64_t>(least), static_cast<std::uint64_t>(most)))
      ->default_str(std::to_string(time.count()));
}

}  // namespace

void LineLimits::addTo(CLI::App& app) {
  addTime(app, "--settle-time", settleTime, 0, kLongestMs,
          "Silence on a line before a write-read is sent [ms]; use more than the pause before an "
          "answer that the instrument repeats");
  addTime(app, "--quiet-time", quietTime, 0, kLongestMs,
          "The same after an answer that was late, damaged or too long [ms]; use more than the "
          "pauses within an answer");
  addTime(app, "--resync-limit", resyncLimit, 0, kLongestMs,
          "How long after its timeout an answer may still arrive [ms]: nothing is sent until it "
          "has arrived or this time has passed");
  addTime(app, "--max-timeout", maxTimeout, 1, kLongestSeconds,
          "Longest time that one request may use the line, including retries [s]");
  app.add_option("--max-retries", maxRetries, "Highest number of retries of one request")
      ->check(wholeNumber(0, kMostRetries))
      ->capture_default_str();
}

}  // namespace mpf
