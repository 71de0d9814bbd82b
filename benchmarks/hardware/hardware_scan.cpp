// SPDX-License-Identifier: MIT
// The rows of `mpf bench hardware` about the cost of scanning. They run the parts of
// mpf-ip330-server in a process of the benchmark, which can read the CPU time of the driver's
// thread.
#include <pthread.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <optional>
#include <stdexcept>

#include <mpf/drivers/industry_pack/model_carrier.h>

#include "benchmarks/hardware/hardware.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/meter.h"
#include "drivers/ip330/ip330_model.h"
#include "server/programs/ip330_server/ip330_servers.h"

namespace mpf::bench {
namespace {

constexpr auto kFirstScan = std::chrono::seconds(10);
constexpr auto kScanAtLeast = std::chrono::seconds(1);

// The results of the measurement, in Figures::more. The last two are percent of one CPU.
enum ScanFound : std::size_t { scansPerSecond, scansMissed, driversThread, wholeProcess };

double nsOf(clockid_t clock) {
  timespec used{};
  ::clock_gettime(clock, &used);
  return static_cast<double>(used.tv_sec) * 1e9 + static_cast<double>(used.tv_nsec);
}

// The CPU clock of the thread that reads the mailboxes and calls subscribers.
clockid_t clockOfDriver(Ip330& board) {
  std::atomic<clockid_t> clock{0};
  std::atomic<bool> isKnown{false};
  const auto subscription = board.subscribe([&](const Ip330Sample&) {
    clockid_t mine{};
    if (::pthread_getcpuclockid(::pthread_self(), &mine) != 0) return;
    clock.store(mine, std::memory_order_relaxed);
    // PAIR(bench-clock): once isKnown is visible, the clock is.
    isKnown.store(true, std::memory_order_release);
  });
  // PAIR(bench-clock): see above.
  if (!waitUntil([&] { return isKnown.load(std::memory_order_acquire); }, kFirstScan))
    throw std::runtime_error("the model of the IP330 delivered no scan in time");
  return clock.load(std::memory_order_relaxed);
}

void measureScanning(const RunContext& context, const Bench& bench) {
  IndustryPackCarriers carriers;
  auto carrier = std::make_unique<ModelCarrier>();
  carrier->plug("IP_a", std::make_unique<Ip330Model>(Ip330ModelOptions{.noise = 0.5}));
  carriers.add("ipac", std::move(carrier));
  IndustryPackModules modules(carriers);
  auto& module = modules.create("adc", "ipac", "IP_a", kIp330);
  const ServerLog log("mpf-bench", "off");
  const auto backplane = Backplane::attach(bench.backplane);
  ServerOptions options;
  options.waitMode = waitMode(bench.wait);
  Ip330Servers servers(backplane, options, module,
                       {.lastChannel = kIp330Channels - 1, .microsecondsPerScan = 1000}, log);
  servers.addScan("adc", 20, 0, kIp330Channels - 1, std::chrono::milliseconds(0));

  auto& board = servers.board();
  const auto driver = clockOfDriver(board);
  sleepFor(context.budget().warmUp);
  const auto before = board.counters();
  const auto driverBefore = nsOf(driver);
  const auto processBefore = cpuNsOf(::getpid());
  const auto fromNs = Clock::nowNs();
  sleepFor(std::max<Nanoseconds>(context.budget().measure, kScanAtLeast));
  const auto elapsedNs = static_cast<double>(Clock::nowNs() - fromNs);
  const auto after = board.counters();
  auto& more = context.figures().more;
  more[driversThread] = 100 * (nsOf(driver) - driverBefore) / elapsedNs;
  more[wholeProcess] = 100 * (cpuNsOf(::getpid()) - processBefore) / elapsedNs;
  more[scansPerSecond] = static_cast<double>(after.scans - before.scans) * 1e9 / elapsedNs;
  more[scansMissed] = static_cast<double>(after.missed - before.missed);
}

Outcome runScanning(const Stage& stage, const Bench& bench) {
  Workload workload;
  workload.requester = [&](const RunContext& context) {
    pinTo(stage.placement().server);
    measureScanning(context, bench);
  };
  auto outcome = stage.run(workload);
  removeBackplanes(bench.backplane);
  return outcome;
}

}  // namespace

std::vector<Measurement> scanRows(const Bench& bench) {
  // All rows show results of the same measurement.
  const auto seen = std::make_shared<std::optional<Outcome>>();
  const auto row = [&](const std::string& name, const std::string& unit, std::size_t what) {
    Measurement made;
    made.question = kScanning;
    made.name = name;
    made.mode = bench.wait;
    made.unit = unit;
    made.share = what == scansPerSecond ? 4 : 0;
    made.isSlow = true;
    made.run = [=](const Stage& stage) {
      if (!*seen) *seen = runScanning(stage, bench);
      auto outcome = **seen;
      outcome.figures.value = outcome.figures.more[what];
      return outcome;
    };
    return made;
  };
  return {row("scans read", "scans a second", scansPerSecond),
          row("scans missed", "times that scans were overwritten", scansMissed),
          row("the driver's thread", "% of one CPU", driversThread),
          row("the whole process, model included", "% of one CPU", wholeProcess)};
}

}  // namespace mpf::bench
