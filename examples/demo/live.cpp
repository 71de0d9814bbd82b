// SPDX-License-Identifier: MIT
// mpf-demo: writes to a DAC and to digital lines, reads the inputs that are wired to them and an
// instrument, and draws the values until q is pressed. Without a terminal it prints lines for some
// seconds. examples/demo/hardware starts the servers.
//
// A slow host does not make a run fail: the run succeeds once each of the three was seen to work,
// and whenever the user ends it.
#include <sys/ioctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>
#include <numbers>
#include <thread>

#include <mpf/clock.h>

#include "base/command_line.h"
#include "base/run_main.h"
#include "base/stop_signals.h"
#include "devices.h"
#include "picture.h"
#include "tools/report/screen.h"

namespace {

using namespace std::chrono_literals;
using mpf::demo::Sample;

// The pause between writing and reading, longer than the averaging time of the ADC.
constexpr auto kPause = 40ms;
constexpr double kPeriodSeconds = 4, kAmplitudeVolts = 4;
constexpr int kRoundsPerLine = 10;
constexpr double kCloseVolts = 0.05;
constexpr double kAwayVolts = 1;  // an ADC without a wire measures about 0 V
constexpr int kMoreRounds = 100;  // further rounds after the time if something was not seen yet

struct Options {
  std::string backplane;
  mpf::Nanoseconds duration{0};
  std::chrono::milliseconds patience{250};
};

std::atomic<bool> isStopped{
    false};  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables): of a signal handler

// The parts that were seen to work.
struct Verdict {
  int followed = 0, measured = 0, measuredAway = 0, instrument = 0, rounds = 0;

  void add(const Sample& sample) {
    ++rounds;
    if (sample.inputs && sample.inputs == sample.outputs) ++followed;
    if (sample.written && sample.measured &&
        std::abs(*sample.written - *sample.measured) < kCloseVolts) {
      ++measured;
      if (std::abs(*sample.written) > kAwayVolts) ++measuredAway;
    }
    if (sample.instrument) ++instrument;
  }
  [[nodiscard]] bool isGood() const { return std::min({followed, measuredAway, instrument}) > 0; }
};

// A sine, and a bit that moves along the lines.
class Rounds {
 public:
  Rounds(const std::string& backplane, std::chrono::milliseconds patience, mpf::Deadline end)
      : devices_(mpf::Backplane::attach(backplane), patience), end_(end) {}
  void next() {
    const auto seconds = static_cast<double>(mpf::Clock::nowNs() - begin_) * 1e-9;
    const auto volts = kAmplitudeVolts * std::sin(2 * std::numbers::pi * seconds / kPeriodSeconds);
    const auto place = static_cast<int>(4 * seconds) % 14;
    devices_.give(volts, static_cast<std::uint8_t>(1 << std::min(place, 14 - place)));
    std::this_thread::sleep_for(kPause);
    const auto sample = devices_.look();
    picture_.add(sample);
    verdict_.add(sample);
    if (end_.hasPassed()) ++late_;
  }
  [[nodiscard]] std::vector<mpf::tools::TopLine> lines(int rows, int columns) const {
    return picture_.lines(rows, columns, devices_.reportedChanges());
  }
  [[nodiscard]] std::string line() const { return picture_.line(devices_.reportedChanges()); }
  [[nodiscard]] const Verdict& verdict() const noexcept { return verdict_; }
  // True when the user has ended the run, or when the time is over and all parts were seen or no
  // rounds are left.
  [[nodiscard]] bool areOver() const {
    if (isStopped.load(std::memory_order_relaxed)) return true;
    return end_.hasPassed() && (verdict_.isGood() || late_ >= kMoreRounds);
  }

 private:
  std::int64_t begin_ = mpf::Clock::nowNs();
  mpf::demo::DemoDevices devices_;
  mpf::Deadline end_;
  mpf::demo::Picture picture_;
  Verdict verdict_;
  int late_ = 0;
};

int columns() {
  winsize size{};
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

void draw(Rounds& rounds) {
  mpf::tools::Screen screen;
  while (!rounds.areOver()) {
    rounds.next();
    screen.draw(rounds.lines(screen.rows(), columns()));
    while (const auto key = screen.tryKey()) {
      if (*key == 'q') isStopped.store(true, std::memory_order_relaxed);
    }
  }
}

void print(Rounds& rounds) {
  for (int round = 0; !rounds.areOver(); ++round) {
    rounds.next();
    if (round % kRoundsPerLine == 0) fmt::print("{}\n", rounds.line());
    std::fflush(stdout);
  }
}

int run(const Options& options) {
  const bool hasTerminal = ::isatty(STDIN_FILENO) != 0 && ::isatty(STDOUT_FILENO) != 0;
  constexpr mpf::Nanoseconds kNoLimit{0};
  const auto duration = options.duration != kNoLimit || hasTerminal
                            ? options.duration
                            : mpf::Nanoseconds(std::chrono::seconds(5));
  const auto end = duration != kNoLimit ? mpf::Deadline::after(duration) : mpf::Deadline::never();
  const mpf::StopSignals stop(
      [](void*) noexcept { isStopped.store(true, std::memory_order_relaxed); }, nullptr);
  Rounds rounds(options.backplane, options.patience, end);
  (hasTerminal ? draw : print)(rounds);
  const auto& verdict = rounds.verdict();
  fmt::print(
      "of {} rounds: the ADC measured the output of the DAC in {}, inputs followed outputs in {}, "
      "the voltmeter answered in {}\n",
      verdict.rounds, verdict.measured, verdict.followed, verdict.instrument);
  return verdict.isGood() || isStopped.load(std::memory_order_relaxed) ? 0 : 1;
}

int demo(int argc, char** argv) {
  Options options;
  CLI::App app(
      "mpf-demo - a client of the servers that examples/demo/hardware starts: draws their values",
      "mpf-demo");
  app.add_option("--backplane", options.backplane,
                 "Backplane; default: $MPF_BACKPLANE, or \"default\"");
  mpf::addTime(app, "--seconds", options.duration,
               "Time until the program ends; 0: 5s without a terminal, else until q");
  mpf::addTime(app, "--patience", options.patience, "Longest wait for an answer",
               {.least = std::chrono::milliseconds(1)});
  if (const auto status = mpf::parseCommandLine(app, argc, argv)) return *status;
  return run(options);
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain("mpf-demo", [&] { return demo(argc, argv); });
}
