// SPDX-License-Identifier: MIT
// The rows of `mpf bench epics` about 10 000 records that the IOC scans at 10 Hz.
#include <unistd.h>

#include <algorithm>
#include <fmt/format.h>
#include <memory>
#include <optional>

#include "benchmarks/epics/bench_ioc.h"
#include "benchmarks/epics/epics.h"
#include "benchmarks/epics/record_server.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/meter.h"

namespace mpf::bench {
namespace {

constexpr int kScannedRecords = 10'000;
constexpr auto kScannedAtLeast = std::chrono::seconds(3);

// The results of the measurement, in Figures::more.
enum ScannedFound : std::size_t { requestsEachSecond, cpuOfIoc };

void measureScan(const RunContext& context, const EpicsBench& bench) {
  std::string database;
  for (int number = 0; number < kScannedRecords; ++number)
    database += fmt::format(
        "record(longin, \"s{}\") {{ field(DTYP, \"MPF\") field(INP, \"@{} type=int32\")"
        " field(SCAN, \".1 second\") }}\n",
        number, kServer);
  auto& ioc = loadBenchIoc();
  ioc.start(bench.backplane, database);
  waitUntilValid(ioc, "s0");
  sleepFor(std::max<Nanoseconds>(context.budget().warmUp, std::chrono::seconds(1)));
  const auto before = context.consumedCount();
  const auto cpuBefore = cpuNsOf(::getpid());
  const auto fromNs = Clock::nowNs();
  sleepFor(std::max<Nanoseconds>(context.budget().measure, kScannedAtLeast));
  const auto elapsedNs = static_cast<double>(Clock::nowNs() - fromNs);
  auto& more = context.figures().more;
  more[requestsEachSecond] =
      static_cast<double>(context.consumedCount() - before) * 1e9 / elapsedNs;
  more[cpuOfIoc] = 100 * (cpuNsOf(::getpid()) - cpuBefore) / elapsedNs;
}

}  // namespace

std::vector<Measurement> scannedRows(const EpicsBench& bench) {
  // Both rows show results of the same measurement.
  const auto seen = std::make_shared<std::optional<Outcome>>();
  const auto row = [&](const std::string& name, const std::string& unit, std::size_t what) {
    Measurement made;
    made.question = kScanned;
    made.name = name;
    made.mode = bench.wait;
    made.unit = unit;
    made.share = what == requestsEachSecond ? 4 : 0;
    made.isSlow = true;
    made.run = [=](const Stage& stage) {
      if (!*seen) {
        Workload workload;
        workload.server = [&](const RunContext& context) { echoRequests(context, bench); };
        workload.requester = [&](const RunContext& context) { measureScan(context, bench); };
        *seen = stage.run(workload);
        removeBackplanes(bench.backplane);
      }
      auto outcome = **seen;
      outcome.figures.value = outcome.figures.more[what];
      return outcome;
    };
    return made;
  };
  return {row("requests that the server received", "a second", requestsEachSecond),
          row(kIocCpu, "% of one CPU", cpuOfIoc)};
}

}  // namespace mpf::bench
