// SPDX-License-Identifier: MIT
// Round trips while both CPUs have other work: a process that computes all the time runs beside the
// server, and another one beside the requester, with the same priority.
#include <algorithm>
#include <vector>

#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/measurement.h"

namespace mpf::bench {
namespace {

constexpr const char* kLoadedQuestion = "Round trip of 4 B while both CPUs are busy";
// Long: a process that has to give up its CPU gets it back some milliseconds later.
constexpr double kLoadedShare = 4;

// A process on each CPU that computes until it is killed.
class BusyCpus {
 public:
  explicit BusyCpus(const Placement& placement) {
    for (const auto& side : {placement.server, placement.requester}) {
      for (const auto cpu : side) pids_.push_back(forkProcess([cpu] { compute(cpu); }));
    }
  }
  ~BusyCpus() {
    for (const auto pid : pids_) killProcess(pid);
  }
  BusyCpus(const BusyCpus&) = delete;
  BusyCpus& operator=(const BusyCpus&) = delete;

 private:
  static void compute(int cpu) {
    pinTo({cpu});
    for (std::uint64_t value = 1;; value = value * 6364136223846793005u + 1)
      asm volatile("" : : "r"(value));
  }
  std::vector<int> pids_;
};

// The same row beside busy processes.
Measurement underLoad(Measurement row) {
  row.question = kLoadedQuestion;
  row.share = kLoadedShare;
  row.run = [quiet = std::move(row.run)](const Stage& stage) {
    const BusyCpus busy(stage.placement());
    auto outcome = quiet(stage);
    outcome.figures.typicalNs = 0;  // a group that is timed as a whole contains waits for the CPU
    return outcome;
  };
  return row;
}

}  // namespace

std::vector<Measurement> underLoadMeasurements(const std::string& runName) {
  std::vector<Measurement> rows;
  for (auto& row : floorMeasurements()) {
    if (row.name != kFutexBounce) continue;
    rows.push_back(underLoad(std::move(row)));
    rows.back().name = kLoadedFutexBounce;
  }
  for (auto& row : peerMeasurements(runName + "-load")) {
    const bool isWanted =
        row.question == kSmallRoundTrip && (row.name == kMpf || row.name == kUnixSocket);
    if (!isWanted) continue;
    rows.push_back(underLoad(std::move(row)));
    rows.back().floorName = kLoadedFutexBounce;
  }
  return rows;
}

}  // namespace mpf::bench
