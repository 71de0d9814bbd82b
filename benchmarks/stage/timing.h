// SPDX-License-Identifier: MIT
// The timing loops of the requester, which are the same for the floors and for all peers.
#pragma once

#include <algorithm>
#include <vector>

#include "benchmarks/stage/meter.h"
#include "benchmarks/stage/stage.h"
#include "benchmarks/stage/stopwatch.h"

namespace mpf::bench {

// The median duration of groups of calls, divided by the number of calls in a group. The counter of
// some processors moves in steps of 10 ns, and reading it takes about as long: single durations
// show the distribution, groups show the cost of a call.
template <class RoundTrip>
double typicalNs(const Stopwatch& watch, Nanoseconds budget, double aboutNs,
                 RoundTrip&& roundTrip) {
  const auto perGroup =
      static_cast<std::size_t>(std::clamp(20'000.0 / std::max(aboutNs, 1.0), 1.0, 100.0));
  std::vector<double> groups;
  groups.reserve(1u << 16);
  const auto end = Stopwatch::start() + watch.ticksOf(budget);
  for (std::uint64_t now = 0; (now < end && groups.size() < groups.capacity()) || groups.empty();) {
    const auto from = Stopwatch::start();
    for (std::size_t i = 0; i < perGroup; ++i) roundTrip();
    now = Stopwatch::stop();
    groups.push_back(watch.elapsed(from, now) / static_cast<double>(perGroup));
  }
  const auto middle = groups.begin() + static_cast<std::ptrdiff_t>(groups.size() / 2);
  std::nth_element(groups.begin(), middle, groups.end());
  return *middle;
}

// Calls `roundTrip` repeatedly. Half of the time it is timed for each call, the other half in
// groups.
template <class RoundTrip>
void timeEach(const RunContext& context, RoundTrip&& roundTrip) {
  const Stopwatch watch;
  const auto warm = Stopwatch::start() + watch.ticksOf(context.budget().warmUp);
  do roundTrip();
  while (Stopwatch::start() < warm);

  LatencyRecorder recorder;  // private: a shared one would be a line that bounces
  const auto half = context.budget().measure / 2;
  const auto end = Stopwatch::start() + watch.ticksOf(half);
  for (std::uint64_t now = 0; now < end;) {
    const auto from = Stopwatch::start();
    roundTrip();
    now = Stopwatch::stop();
    recorder.add(watch.elapsedNs(from, now));
  }
  context.figures().typicalNs =
      typicalNs(watch, half, static_cast<double>(recorder.percentileNs(50)), roundTrip);
  context.figures().latency = recorder;
}

// Calls `step`, which completes `perStep` messages, repeatedly. The result is messages per second.
template <class Step>
void timeRate(const RunContext& context, std::uint64_t perStep, Step&& step) {
  const auto warm = Deadline::after(context.budget().warmUp);
  do step();
  while (!warm.hasPassed());

  const auto fromNs = Clock::nowNs();
  const auto end = Deadline::after(context.budget().measure);
  std::uint64_t steps = 0;
  do {
    for (int i = 0; i < 16; ++i) step();  // the clock costs 20 ns
    steps += 16;
  } while (!end.hasPassed());
  const auto elapsedNs = Clock::nowNs() - fromNs;
  context.figures().count = steps * perStep;
  context.figures().perSecond =
      static_cast<double>(steps * perStep) * 1e9 / static_cast<double>(elapsedNs);
}

// Calls `exchange`, which sends `perExchange` messages and receives their replies, repeatedly. The
// latency is that of an exchange; the rate is that of the messages.
template <class Exchange>
void timeExchanges(const RunContext& context, Meter& meter, std::uint64_t perExchange,
                   Exchange&& exchange) {
  const Stopwatch watch;
  const auto warm = Stopwatch::start() + watch.ticksOf(context.budget().warmUp);
  do exchange();
  while (Stopwatch::start() < warm);

  LatencyRecorder recorder;  // private: a shared one would be a line that bounces
  meter.start();
  const auto begin = Stopwatch::start();
  const auto end = begin + watch.ticksOf(context.budget().measure);
  std::uint64_t now = begin;
  while (now < end) {
    const auto from = Stopwatch::start();
    exchange();
    now = Stopwatch::stop();
    recorder.add(watch.elapsedNs(from, now));
  }
  meter.stop(context.figures());
  context.figures().latency = recorder;
  context.figures().count = recorder.count() * perExchange;
  context.figures().perSecond =
      static_cast<double>(context.figures().count) * 1e9 / watch.elapsed(begin, now);
}

// Keeps `window` messages outstanding: `receive` receives the oldest reply, then `send` sends
// another message. Each message is timed from its send to its reply.
template <class Send, class Receive>
void timeWindow(const RunContext& context, Meter& meter, std::size_t window, Send&& send,
                Receive&& receive) {
  const Stopwatch watch;
  std::vector<std::uint64_t> sentAt(window);
  const auto sendAt = [&](std::size_t place) {
    sentAt[place] = Stopwatch::start();
    send();
  };
  LatencyRecorder recorder;
  std::size_t oldest = 0;
  const auto resume = [&](Nanoseconds duration) {
    const auto end = Stopwatch::start() + watch.ticksOf(duration);
    for (std::uint64_t now = 0; now < end; oldest = (oldest + 1) % window) {
      receive();
      now = Stopwatch::stop();
      recorder.add(watch.elapsedNs(sentAt[oldest], now));
      sendAt(oldest);
    }
  };
  for (std::size_t place = 0; place < window; ++place) sendAt(place);
  resume(context.budget().warmUp);

  recorder = {};
  meter.start();
  const auto begin = Stopwatch::start();
  resume(context.budget().measure);
  const auto elapsed = watch.elapsed(begin, Stopwatch::stop());
  meter.stop(context.figures());
  for (std::size_t i = 0; i < window; ++i) receive();
  context.figures().latency = recorder;
  context.figures().count = recorder.count();
  context.figures().perSecond = static_cast<double>(recorder.count()) * 1e9 / elapsed;
}

// For one-way traffic: `flood(resume)` sends while resume() returns true. The rate is that of the
// messages that the other process has received.
template <class Flood>
void timeOneWay(const RunContext& context, Flood&& flood) {
  std::int64_t fromNs = 0;
  std::uint64_t fromCount = 0;
  const auto startNs = Clock::nowNs();
  const auto warmNs = startNs + context.budget().warmUp.count();
  flood([&] {
    const auto nowNs = Clock::nowNs();
    if (fromNs == 0 && nowNs >= warmNs) {
      fromNs = nowNs;
      fromCount = context.consumedCount();
    }
    if (fromNs == 0 || nowNs <= fromNs + context.budget().measure.count()) return true;
    if (context.figures().perSecond == 0) {
      context.figures().count = context.consumedCount() - fromCount;
      context.figures().perSecond =
          static_cast<double>(context.figures().count) * 1e9 / static_cast<double>(nowNs - fromNs);
    }
    return false;
  });
}

}  // namespace mpf::bench
