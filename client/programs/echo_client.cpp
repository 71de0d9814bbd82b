// SPDX-License-Identifier: MIT
#include "client/programs/echo_client.h"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fmt/format.h>
#include <limits>
#include <memory>

#include <mpf/sync_client.h>

#include "base/command_line.h"
#include "base/duration_text.h"
#include "base/latency_recorder.h"
#include "base/log_limiter.h"
#include "base/print_error.h"
#include "base/run_main.h"

namespace mpf {
namespace {

constexpr std::uint64_t kMost = std::numeric_limits<int>::max();
constexpr std::uint64_t kMostBytes = 1u << 30;

struct EchoOptions {
  std::string server;
  std::string backplane;
  std::int32_t location = Backplane::defaultLocation();
  int count = 1000;
  Nanoseconds timeout = std::chrono::seconds(1);
  std::size_t bytes = 100;
};

// Counts the calls, reports failures on stderr, and prints a summary.
class EchoStatistics {
 public:
  void add(std::int64_t roundTripNs) { roundTrips_->add(static_cast<std::uint64_t>(roundTripNs)); }
  void fail(const std::string& why) {
    ++failures_;
    const auto nowNs = Clock::nowNs();
    if (limiter_.dueNs() <= nowNs) say(limiter_.takeDue(nowNs));
    if (limiter_.admit({}, 0, why, nowNs)) say({{0, why}});
  }
  // Prints the summary. Returns the exit status: 0 when the server echoed every message.
  int report() {
    say(limiter_.takeAll(Clock::nowNs()));
    const auto at = [&](double percent) {
      return durationText(static_cast<double>(roundTrips_->percentileNs(percent)));
    };
    fmt::print("{} came back, {} did not", roundTrips_->count(), failures_);
    if (roundTrips_->count() != 0)
      fmt::print("; round trip: p50 {}, p99 {}, max {}", at(50), at(99), at(100));
    fmt::print("\n");
    return failures_ == 0 ? 0 : 1;
  }

 private:
  static void say(const std::vector<LogLimiter::Line>& lines) {
    for (const auto& line : lines) printError("{}\n", line.text);
  }

  LogLimiter limiter_;  // of lines for failures: each message may fail
  std::unique_ptr<LatencyRecorder> roundTrips_ = std::make_unique<LatencyRecorder>();
  std::uint64_t failures_ = 0;
};

int callEchoServer(const EchoOptions& options, const EchoClient& echo) {
  SyncClient client(Backplane::attach(options.backplane), options.server, options.location);
  EchoStatistics statistics;
  for (int i = 0; i < options.count; ++i) {
    const auto sentNs = Clock::nowNs();
    auto answer = client.call(echo.make(i, options.bytes), options.timeout);
    if (!answer) {
      statistics.fail(fmt::format("message {}: {}", i, answer.why()));
    } else if (!echo.isEcho(i, options.bytes, answer.message())) {
      statistics.fail(fmt::format("message {}: the reply differs from the message", i));
    } else {
      statistics.add(Clock::nowNs() - sentNs);
    }
  }
  return statistics.report();
}

int callServer(int argc, char** argv, const EchoClient& echo) {
  CLI::App app(fmt::format("{} - sends {}s to an echo server and checks its replies", echo.program,
                           echo.what),
               echo.program);
  EchoOptions options;
  options.server = echo.server;
  app.add_option("server", options.server, "Name of the server")->capture_default_str();
  app.add_option("--backplane", options.backplane,
                 "Backplane; default: $MPF_BACKPLANE, or \"default\"");
  app.add_option("--location", options.location,
                 "Location of the server; default: $MPF_LOCATION, or 0");
  app.add_option("--count", options.count, "Messages to send")
      ->capture_default_str()
      ->check(wholeNumber(1, kMost));
  addTime(app, "--timeout", options.timeout, "Longest wait for a reply", kAboveZero);
  if (echo.isArray)
    app.add_option("--bytes", options.bytes, "Size of the array in a message [bytes]")
        ->capture_default_str()
        ->check(wholeNumber(0, kMostBytes));
  if (const auto status = parseCommandLine(app, argc, argv)) return *status;
  return callEchoServer(options, echo);
}

}  // namespace

int runEchoClient(int argc, char** argv, const EchoClient& echo) {
  return runMain(echo.program, [&] { return callServer(argc, argv, echo); });
}

}  // namespace mpf
