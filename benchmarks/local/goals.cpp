// SPDX-License-Identifier: MIT
// The goals of `mpf bench local`.
#include "benchmarks/local/goal_sheet.h"
#include "benchmarks/local/report.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {

std::string goals(const std::vector<Result>& results) {
  GoalSheet goals(results);
  const std::string idle = "Round trip of 4 B beside";
  const std::string hundred = "Requests and replies of 4 B with 100 outstanding";
  const auto* small = goals.find("Round trip of 4 B", kMpf, Mode::spin);
  goals.atMost("Int32 round trip, polling, x cache-line bounce, at most",
               goals.ratioToFloor(goals.find("Round trip of 4 B", kMpf, Mode::spin)), 1.1);
  goals.atMost("Int32 round trip, asleep, x futex bounce, at most",
               goals.ratioToFloor(goals.find("Round trip of 4 B", kMpf, Mode::block)), 1.05);
  if (const auto* row = goals.find("Round trip of 4 B in one thread", kMpf, Mode::spin))
    goals.atMost("Int32 round trip in one thread [ns], at most", row->costNs(), 40);
  if (const auto* row = goals.find("One way", kMpf, Mode::spin))
    goals.atLeast("Int32 one way, million a second, at least", row->figures.perSecond / 1e6, 60);
  const auto* batches = goals.find("One way", mpfBatchPeer(true).name, Mode::spin);
  if (batches != nullptr)
    goals.atLeast("Int32 one way, values taken in batches, million a second, at least",
                  batches->figures.perSecond / 1e6, 60);
  goals.atMost("Int32 one way in batches, x the bare slot ring, at most",
               goals.ratioToFloor(batches), 3);
  if (const auto* row = goals.find("One way", kMpf, Mode::adaptive))
    goals.atLeast("Int32 one way, adaptive, million a second, at least",
                  row->figures.perSecond / 1e6, 30);
  if (const auto* row = goals.find(hundred, kMpf, Mode::spin))
    goals.atLeast("100 outstanding, polling, million a second, at least",
                  row->figures.perSecond / 1e6, 20);
  if (const auto* row = goals.find(hundred, mpfRunPeer().name, Mode::spin))
    goals.atLeast("100 outstanding in batches, polling, million a second, at least",
                  row->figures.perSecond / 1e6, 20);
  goals.atMost(
      "1 MiB untouched, polling, x Int32 round trip, at most",
      goals.costRatio(goals.find("Round trip of 1 MiB, untouched", kMpf, Mode::spin), small), 2);
  goals.atMost("1 MiB touched, polling, x memcpy bounce, at most",
               goals.ratioToFloor(goals.find("Round trip of 1 MiB, every", kMpf, Mode::spin)), 1.3);
  for (const auto mode : {Mode::spin, Mode::block}) {
    const auto ratio = goals.costRatio(goals.find(idle, "MPF, 10000 idle", mode),
                                       goals.find(idle, "MPF, 1 idle", mode));
    goals.atMost(fmt::format("Round trip beside 10000 idle clients, {}, x beside one, at most",
                             toString(mode)),
                 ratio, 1.1);
  }
  if (const auto* row = goals.find("Connect", kMpf, Mode::adaptive))
    goals.atMost("Connect [us], at most", row->costNs() / 1e3, 200);
  if (const auto* row = goals.find("CPU of 100", kMpf, Mode::adaptive))
    goals.atMost("CPU of 100 idle processes [% of one CPU], at most", row->figures.value, 0.1);
  return goals.text();
}

}  // namespace mpf::bench
