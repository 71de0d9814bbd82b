// SPDX-License-Identifier: MIT
// The rows of `mpf bench hardware` about eight serial ports at once, beside the manual's table.
#include <fmt/format.h>
#include <optional>

#include "benchmarks/hardware/hardware.h"
#include "benchmarks/hardware/serial_ends.h"
#include "benchmarks/stage/meter.h"
#include "benchmarks/stage/stopwatch.h"

namespace mpf::bench {
namespace {

constexpr std::size_t kCharacters = 100;
constexpr int kBaud = 38400;
constexpr int kBitsOfACharacter = 10;
// Messages per second that the lines can carry.
constexpr double kLineLimit =
    static_cast<double>(kPorts) * kBaud / kBitsOfACharacter / static_cast<double>(kCharacters);
constexpr auto kTrafficAtLeast = std::chrono::seconds(1);
constexpr const char* kPercentOfCpu = "% of one CPU";

// Index of the server's CPU time in Figures::more.
constexpr std::size_t kServerCpu = 0;  // percent of one CPU

// Measures all ports at once, with one outstanding request at each.
void measurePorts(const RunContext& context, const HardwareServers& servers, bool awaitsEcho) {
  const Stopwatch watch;
  std::array<std::uint64_t, kPorts> sentAt{};
  LatencyRecorder recorder;
  PortClients* sender = nullptr;
  const auto send = [&](std::size_t port) {
    sentAt.at(port) = Stopwatch::start();
    sender->send(port);
  };
  PortClients clients(servers.bench(), kPorts, kCharacters, awaitsEcho,
                      [&](std::size_t port, bool isWhole) {
                        if (isWhole)
                          recorder.add(watch.elapsedNs(sentAt.at(port), Stopwatch::stop()));
                        send(port);
                      });
  sender = &clients;
  for (std::size_t port = 0; port < clients.size(); ++port) send(port);
  const auto resume = [&](Nanoseconds duration) {
    for (const auto end = Deadline::after(duration); !end.hasPassed();) clients.runOnce();
  };
  resume(context.budget().warmUp);

  recorder = {};
  static_cast<void>(clients.takeFaults());  // of the warm-up
  const auto cpuBefore = cpuNsOf(servers.pid());
  const auto fromNs = Clock::nowNs();
  resume(std::max<Nanoseconds>(context.budget().measure, kTrafficAtLeast));
  const auto elapsedNs = static_cast<double>(Clock::nowNs() - fromNs);
  auto& figures = context.figures();
  figures.more[kServerCpu] = 100 * (cpuNsOf(servers.pid()) - cpuBefore) / elapsedNs;
  if (awaitsEcho) figures.lineFaults = clients.takeFaults();
  figures.latency = recorder;
  figures.count = recorder.count();
  figures.perSecond = static_cast<double>(figures.count) * 1e9 / elapsedNs;
}

Outcome runPorts(const Stage& stage, HardwareServers& servers, bool awaitsEcho) {
  Workload workload;
  workload.server = playInstruments(stage, servers, awaitsEcho);
  workload.requester = [&](const RunContext& context) {
    measurePorts(context, servers, awaitsEcho);
  };
  return servers.run([&] { return stage.run(workload); });
}

// A row for comparison whose number is not measured.
Measurement known(const Bench& bench, const std::string& name, const Figures& figures) {
  Measurement row;
  row.question = kSerial;
  row.name = name;
  row.mode = bench.wait;
  row.bytes = kCharacters;
  row.detail = kNotMeasured;
  row.share = 0;
  row.isSlow = true;
  row.run = [figures](const Stage&) {
    Outcome outcome;
    outcome.figures = figures;
    return outcome;
  };
  return row;
}

Measurement knownRate(const Bench& bench, const std::string& name, double perSecond) {
  Figures figures;
  figures.perSecond = perSecond;
  return known(bench, name, figures);
}

Measurement knownCpu(const Bench& bench, const std::string& name, double percent) {
  Figures figures;
  figures.value = percent;
  auto row = known(bench, name + ": CPU of its time", figures);
  row.unit = kPercentOfCpu;
  return row;
}

// Rows for the message rate, the CPU time of the server and the incomplete answers, all from the
// same measurement.
std::vector<Measurement> rowsAbout(const Bench& bench, const std::string& name, bool takesTime,
                                   bool awaitsEcho) {
  const auto servers = std::make_shared<HardwareServers>(bench, eightPorts(takesTime));
  const auto seen = std::make_shared<std::optional<Outcome>>();
  const auto run = [=](const Stage& stage) {
    if (!*seen) *seen = runPorts(stage, *servers, awaitsEcho);
    return **seen;
  };
  auto rate = rowOf(servers, "eight ports, " + name, kSerial, name);
  rate.bytes = kCharacters;
  rate.isSlow = true;
  rate.share = 4;
  rate.floorName = kManualLocal;
  rate.floorBytes = kCharacters;
  rate.run = run;
  const auto more = [&](const std::string& what, const std::string& unit, std::size_t at) {
    auto row = rate;
    row.name += what;
    row.unit = unit;
    row.floorName.clear();
    row.share = 0;
    row.run = [=](const Stage& stage) {
      auto outcome = run(stage);
      outcome.figures.value = outcome.figures.more[at];
      return outcome;
    };
    return row;
  };
  std::vector<Measurement> rows{rate, more(": CPU, model included", kPercentOfCpu, kServerCpu)};
  if (awaitsEcho) {
    rows.push_back(more(": characters were lost", kShortAnswers, kServerCpu));
    rows.back().run = [=](const Stage& stage) {
      auto outcome = run(stage);
      outcome.figures.value = outcome.figures.lineFaults.shortAnswers;
      return outcome;
    };
  }
  return rows;
}

}  // namespace

std::vector<std::string> eightPorts(bool takesTime) {
  std::vector<std::string> words{"mpf-serial-server", "--carrier", "ipac=model", "--octal-uart",
                                 "UART,ipac,IP_a,8,100"};
  for (int port = 0; port < kPorts; ++port) {
    words.insert(words.end(),
                 {"--octal-port", fmt::format("UART{},UART,{},{},N,1,8,N", port, port, kBaud),
                  "--server", fmt::format("port{},UART{},1000,20,\\r,1", port, port)});
  }
  // No settling time, to measure what server and lines can do: the model repeats no answers.
  words.insert(words.end(), {"--settle-time", "0"});
  if (takesTime) words.emplace_back("--octal-timing");
  return words;
}

std::vector<Measurement> serialRows(const Bench& bench) {
  std::vector<Measurement> rows{
      knownRate(bench, kManualLocal, 159), knownCpu(bench, kManualLocal, 89),
      knownRate(bench, kManualRemote, 156), knownCpu(bench, kManualRemote, 91),
      knownRate(bench, "what the lines carry", kLineLimit)};
  for (auto more : {rowsAbout(bench, "written", true, false),
                    rowsAbout(bench, "written, echo read", true, true),
                    rowsAbout(bench, "written, echo read, no line time", false, true)})
    std::move(more.begin(), more.end(), std::back_inserter(rows));
  return rows;
}

}  // namespace mpf::bench
