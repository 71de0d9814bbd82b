// SPDX-License-Identifier: MIT
// The goals of `mpf bench remote`, at each place.
#include <algorithm>

#include "benchmarks/local/goal_sheet.h"
#include "benchmarks/remote/remote.h"

namespace mpf::bench {
namespace {

constexpr double kGiB = 1024.0 * 1024 * 1024;

// A row's rate as a multiple of raw TCP's.
std::optional<double> timesTcp(const GoalSheet& goals, const Result* row) {
  const auto ratio = goals.ratioToFloor(row);
  return ratio ? std::optional(1 / *ratio) : std::nullopt;
}

// The goal is 1 GiB/s in each direction, or 80 % of the rate of raw TCP if that is less.
void arraysAtLeast(GoalSheet& goals, const std::string& place, const std::string& name) {
  const auto* row = goals.find(place + kArrays, "MPF remote, " + name);
  if (row == nullptr) return;
  const auto reached = row->figures.perSecond * static_cast<double>(row->measurement.bytes) / kGiB;
  const auto times = timesTcp(goals, row);
  goals.atLeast(place + ": " + name + " [GiB/s]", reached,
                times ? std::min(1.0, 0.8 * reached / *times) : 1.0);
}

void addGoals(GoalSheet& goals, const std::string& place) {
  const auto messages = [&](const std::string& name) {
    return timesTcp(goals, goals.find(place + kMessages, "MPF remote, " + name));
  };
  goals.atLeast(place + ": no buffer, x raw TCP, at least", messages("no buffer"), 0.8);
  goals.atLeast(place + ": 100 buffered, x raw TCP, at least", messages("100 buffered"), 0.6);
  if (const auto* row = goals.find(place + kMessages, "MPF remote, 1000 buffered"))
    goals.atLeast(place + ": 1000 buffered, million a second, at least",
                  row->figures.perSecond / 1e6, 2);
  for (const auto* array : {"Float64Array", "Int32Array"}) {
    for (const auto* way : {", one at a time", ", 4 in flight"})
      arraysAtLeast(goals, place, std::string(array) + way);
  }
  if (const auto* row =
          goals.find(place + kClients, "MPF remote, " + std::to_string(kCrowd) + ", each in turn"))
    goals.atLeast(place + ": clients, at least", static_cast<double>(row->figures.count), kCrowd);
  if (const auto* row = goals.find(place + kIdle, "MPF remote, CPU of both routers"))
    goals.atMost(place + ": idle routers [% of one CPU], at most", row->figures.value, 0.1);
}

}  // namespace

std::string remoteGoals(const std::vector<Result>& results) {
  GoalSheet goals(results);
  for (const auto* place : {kLoopback, kNamespaces}) addGoals(goals, place);
  return goals.text();
}

}  // namespace mpf::bench
