// SPDX-License-Identifier: MIT
// The rows of `mpf bench epics` about records that ask a server, one after another or many at once.
//
//   r0 ─ reply, FLNK ─► r1 ─ reply, FLNK ─► r0 ...      one request of each ring is outstanding
#include <fmt/format.h>

#include <mpf/sync_client.h>

#include "benchmarks/epics/bench_ioc.h"
#include "benchmarks/epics/epics.h"
#include "benchmarks/epics/record_server.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/timing.h"

namespace mpf::bench {
namespace {

constexpr std::size_t kRequestBytes = 4;

// Counts replies for the budget's time.
void countRequests(const RunContext& context) {
  sleepFor(context.budget().warmUp);
  const auto before = context.consumedCount();
  const auto fromNs = Clock::nowNs();
  sleepFor(context.budget().measure);
  auto& figures = context.figures();
  figures.count = context.consumedCount() - before;
  figures.perSecond =
      static_cast<double>(figures.count) * 1e9 / static_cast<double>(Clock::nowNs() - fromNs);
}

// The first record of each ring gets its FLNK when the ring starts.
std::string ringsOf(int rings) {
  std::string database;
  for (int ring = 0; ring < rings; ++ring) {
    database += fmt::format(
        "record(longin, \"a{0}\") {{ field(DTYP, \"MPF\") field(INP, \"@{1} type=int32\") }}\n"
        "record(longin, \"b{0}\") {{ field(DTYP, \"MPF\") field(INP, \"@{1} type=int32\")"
        " field(FLNK, \"a{0}\") }}\n",
        ring, kServer);
  }
  return database;
}

void turnRings(const RunContext& context, const EpicsBench& bench, int rings) {
  auto& ioc = loadBenchIoc();
  ioc.start(bench.backplane, ringsOf(rings));
  for (int ring = 0; ring < rings; ++ring) {
    const auto first = fmt::format("a{}", ring);
    waitUntilValid(ioc, first);
    ioc.put(first + ".FLNK", fmt::format("b{}", ring));
    ioc.put(first + ".PROC", "1");
  }
  countRequests(context);
}

void askBare(const RunContext& context, const EpicsBench& bench) {
  SyncClient client(Backplane::attach(bench.backplane), kServer, 0, {waitMode(bench.wait)});
  Meter meter({}, Meter::kNobody);
  timeExchanges(context, meter, 1, [&] {
    if (!client.call(Int32Message({.address = 3}), kConnectLimit))
      throw std::runtime_error("no reply");
  });
}

// Processes a record without device support of MPF in a loop.
void processSoft(const RunContext& context, const EpicsBench& bench) {
  auto& ioc = loadBenchIoc();
  ioc.start(bench.backplane, R"(record(ai, "soft") { field(INP, "1") })");
  constexpr int kAtOnce = 100;
  timeRate(context, kAtOnce, [&] { ioc.process("soft", kAtOnce); });
}

Measurement rowOf(const EpicsBench& bench, const std::string& name, bool isServed,
                  const std::function<void(const RunContext&)>& requester) {
  Measurement row;
  row.question = kRecords;
  row.name = name;
  row.mode = bench.wait;
  row.bytes = kRequestBytes;
  row.run = [=](const Stage& stage) {
    Workload workload;
    if (isServed)
      workload.server = [&](const RunContext& context) { echoRequests(context, bench); };
    workload.requester = requester;
    auto outcome = stage.run(workload);
    removeBackplanes(bench.backplane);
    return outcome;
  };
  return row;
}

Measurement besideBareClient(Measurement row) {
  row.floorName = kBareClient;
  row.floorBytes = kRequestBytes;
  return row;
}

}  // namespace

std::vector<Measurement> recordRequestRows(const EpicsBench& bench) {
  const auto ringRow = [&](const std::string& name, int rings) {
    return besideBareClient(rowOf(
        bench, name, true, [=](const RunContext& context) { turnRings(context, bench, rings); }));
  };
  auto bare =
      rowOf(bench, kBareClient, true, [=](const RunContext& context) { askBare(context, bench); });
  bare.floorName = kFutexBounce;
  bare.floorBytes = kRequestBytes;
  Measurement manual;
  manual.question = kRecords;
  manual.name = "the manual's, 1999";
  manual.mode = bench.wait;
  manual.detail = "not measured here";
  manual.run = [](const Stage&) {
    Outcome outcome;
    outcome.figures.perSecond = 240;
    return outcome;
  };
  return {bare, ringRow(kOneRecord, 1), ringRow(kThousand, 500), manual,
          rowOf(bench, "soft ai records, no server", false,
                [=](const RunContext& context) { processSoft(context, bench); })};
}

}  // namespace mpf::bench
