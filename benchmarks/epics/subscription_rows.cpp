// SPDX-License-Identifier: MIT
// The rows of `mpf bench epics` about a server that sends values to a record with SCAN "I/O Intr":
// how many the record processes, and how long a value needs to reach a client of Channel Access.
//
//   server ── value ──► record ── Channel Access, loopback ──► monitor in the server's process
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <stdexcept>

#include "benchmarks/epics/bench_ioc.h"
#include "benchmarks/epics/epics.h"
#include "benchmarks/epics/record_server.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/stopwatch.h"

namespace mpf::bench {
namespace {

constexpr auto kFloodAtLeast = std::chrono::seconds(1);

// The results of the measurement, in Figures::more. Each is a rate.
enum FloodFound : std::size_t { messagesSent, messagesProcessed };

// Waits for the record's subscription.
Message waitForSubscriber(MessageServer& server) {
  for (;;) {
    server.waitForMessage();
    if (auto request = server.receive()) return request;
  }
}

// ---- as fast as the server sends

void flood(const RunContext& context, const EpicsBench& bench) {
  auto server = makeRecordServer(bench);
  context.ready();
  const auto request = waitForSubscriber(server);
  for (std::int32_t value = 0, sent = 0;; ++value) {
    auto message = server.allocReplyMessage<Int32>(request);
    message->value = value;
    if (server.reply(std::move(message)) == ReplyResult::sent)
      context.consumed(static_cast<std::uint64_t>(++sent));
  }
}

void measureFlood(const RunContext& context, const EpicsBench& bench) {
  auto& ioc = loadBenchIoc();
  ioc.start(bench.backplane, fmt::format("record(longin, \"pushed\") {{ field(DTYP, \"MPF\")"
                                         " field(INP, \"@{} type=int32\") field(SCAN, \"I/O Intr\")"
                                         " field(FLNK, \"count\") }}\n"
                                         "record(calc, \"count\") {{ field(INPA, \"count\")"
                                         " field(CALC, \"A+1\") }}\n",
                                         kServer));
  sleepFor(std::max<Nanoseconds>(context.budget().warmUp, std::chrono::milliseconds(300)));
  const auto countNow = [&] { return std::stod(ioc.get("count")); };
  const auto sentBefore = context.consumedCount();
  const auto processedBefore = countNow();
  const auto fromNs = Clock::nowNs();
  sleepFor(std::max<Nanoseconds>(context.budget().measure, kFloodAtLeast));
  const auto seconds = static_cast<double>(Clock::nowNs() - fromNs) / 1e9;
  auto& more = context.figures().more;
  more[messagesSent] = static_cast<double>(context.consumedCount() - sentBefore) / seconds;
  more[messagesProcessed] = (countNow() - processedBefore) / seconds;
}

// ---- one value after another, to a monitor

void sendToMonitor(const RunContext& context, const EpicsBench& bench) {
  auto server = makeRecordServer(bench);
  context.ready();
  const auto request = waitForSubscriber(server);
  auto& client = loadBenchIoc();
  client.monitor("pushed");
  std::int32_t value = 0;
  const auto send = [&] {
    auto message = server.allocReplyMessage<Int32>(request);
    message->value = ++value;
    if (server.reply(std::move(message)) != ReplyResult::sent)
      throw std::runtime_error("a value could not be sent");
    client.waitForMonitor(value);
  };
  const Stopwatch watch;
  const auto warm = Deadline::after(context.budget().warmUp);
  do send();
  while (!warm.hasPassed());
  LatencyRecorder recorder;
  const auto end = Deadline::after(context.budget().measure);
  while (!end.hasPassed()) {
    const auto from = Stopwatch::start();
    send();
    recorder.add(watch.elapsedNs(from, Stopwatch::stop()));
  }
  context.figures().latency = recorder;
  context.figures().count = recorder.count();
  context.consumed(1);
  for (;;) sleepFor(std::chrono::seconds(1));
}

void serveMonitor(const RunContext& context, const EpicsBench& bench) {
  auto& ioc = loadBenchIoc();
  ioc.start(bench.backplane,
            fmt::format("record(longin, \"pushed\") {{ field(DTYP, \"MPF\")"
                        " field(INP, \"@{} type=int32\") field(SCAN, \"I/O Intr\") }}\n",
                        kServer));
  while (context.consumedCount() == 0) sleepFor(std::chrono::milliseconds(5));
}

Outcome runRow(const Stage& stage, const EpicsBench& bench,
               const std::function<void(const RunContext&, const EpicsBench&)>& server,
               const std::function<void(const RunContext&, const EpicsBench&)>& requester) {
  Workload workload;
  workload.server = [&](const RunContext& context) { server(context, bench); };
  workload.requester = [&](const RunContext& context) { requester(context, bench); };
  auto outcome = stage.run(workload);
  removeBackplanes(bench.backplane);
  return outcome;
}

}  // namespace

std::vector<Measurement> subscriptionRows(const EpicsBench& bench) {
  const auto flooded = std::make_shared<std::optional<Outcome>>();
  const auto floodRow = [&](const std::string& name, std::size_t what) {
    Measurement made;
    made.question = kPushed;
    made.name = name;
    made.mode = bench.wait;
    made.unit = "a second";
    made.share = what == messagesSent ? 2 : 0;
    made.isSlow = true;
    made.run = [=](const Stage& stage) {
      if (!*flooded) *flooded = runRow(stage, bench, flood, measureFlood);
      auto outcome = **flooded;
      outcome.figures.value = outcome.figures.more[what];
      return outcome;
    };
    return made;
  };
  Measurement monitored;
  monitored.question = "A value from the server to a monitor of Channel Access";
  monitored.name = "one value after another";
  monitored.mode = bench.wait;
  monitored.run = [=](const Stage& stage) {
    return runRow(stage, bench, sendToMonitor, serveMonitor);
  };
  return {floodRow("messages sent", messagesSent),
          floodRow("messages processed; the others are overruns", messagesProcessed), monitored};
}

}  // namespace mpf::bench
